#include "hm/odometry/tracker/local_map.hpp"

#include <algorithm>
#include <cmath>

namespace hm {
namespace {

constexpr int kCell_px = 32;  // candidates are spread over cells of this size
constexpr double kBorder_px = 10;
constexpr double kMaxScaleChange = 2.0;
constexpr double kMinViewCosine = 0.6;  // between the viewing directions of the anchor and of this view
constexpr std::size_t kSurfacesKept = 8;
constexpr int kTrialLooks = 12;
constexpr double kMinFoundRatio = 0.25;
constexpr std::size_t kYoungKeyframes = 3;

double found_ratio(const MapLandmark& landmark) {
  return (landmark.found + 1.0) / (landmark.looked_for + 1.0);
}

}  // namespace

LocalMap::LocalMap(std::size_t max_landmarks, std::size_t max_keyframes)
    : max_landmarks_(max_landmarks), max_keyframes_(max_keyframes) {}

std::size_t LocalMap::memory_bytes() const {
  std::size_t bytes = landmarks_.capacity() * sizeof(MapLandmark) + free_.capacity() * sizeof(std::size_t);
  for (const MapKeyframe& keyframe : keyframes_) {
    bytes += sizeof(MapKeyframe) + keyframe.pyramid.memory_bytes() + keyframe.surface.memory_bytes() +
             keyframe.grid.depth_m.size() * sizeof(float);
    bytes += keyframe.sightings.capacity() * sizeof(Sighting);
    bytes += keyframe.factors.capacity() * sizeof(SurfaceFactor);
    if (keyframe.record)
      bytes += sizeof(Keyframe) + keyframe.record->features.capacity() * sizeof(Feature) +
               keyframe.record->observations.capacity() * sizeof(LandmarkObservation) +
               (keyframe.record->before
                    ? keyframe.record->before->observations.capacity() * sizeof(LandmarkObservation)
                    : 0);
  }
  return bytes;
}

const MapKeyframe* LocalMap::find(std::size_t identity) const {
  const auto at = std::lower_bound(keyframes_.begin(), keyframes_.end(), identity,
                                   [](const MapKeyframe& k, std::size_t id) { return k.identity < id; });
  return at != keyframes_.end() && at->identity == identity ? &*at : nullptr;
}

MapKeyframe* LocalMap::find(std::size_t identity) {
  return const_cast<MapKeyframe*>(std::as_const(*this).find(identity));
}

std::vector<Candidate> LocalMap::candidates(const SE3& T_odom_camera, const PinholeCamera& camera,
                                            std::size_t limit) const {
  const SE3 T_camera_odom = T_odom_camera.inverse();
  std::vector<Candidate> seen;
  for (std::size_t i = 0; i < landmarks_.size(); ++i) {
    const MapLandmark& landmark = landmarks_[i];
    if (!landmark.alive) continue;
    const Vec3 p = T_camera_odom * landmark.p_odom;
    if (!(p.z() > 0.1)) continue;
    const Vec2 pixel(camera.fx * p.x() / p.z() + camera.cx, camera.fy * p.y() / p.z() + camera.cy);
    if (!(pixel.x() > kBorder_px && pixel.y() > kBorder_px && pixel.x() < camera.width - 1 - kBorder_px &&
          pixel.y() < camera.height - 1 - kBorder_px))
      continue;
    const MapKeyframe* anchor = find(landmark.anchor);
    HM_CHECK(anchor != nullptr, "landmark {} has no anchor {}", i, landmark.anchor);
    const Vec3 first = anchor->T_odom_camera.translation() - landmark.p_odom;
    const Vec3 now = T_odom_camera.translation() - landmark.p_odom;
    const double first_m = first.norm(), now_m = now.norm();
    if (now_m > kMaxScaleChange * first_m || first_m > kMaxScaleChange * now_m) continue;
    if (first.dot(now) < kMinViewCosine * first_m * now_m) continue;
    seen.push_back({i, pixel, p});
  }
  // Most reliable first in every cell; then the cells in turn.
  std::sort(seen.begin(), seen.end(), [&](const Candidate& a, const Candidate& b) {
    const MapLandmark &la = landmarks_[a.landmark], &lb = landmarks_[b.landmark];
    const double ra = found_ratio(la) * std::min(la.sightings, 5),
                 rb = found_ratio(lb) * std::min(lb.sightings, 5);
    return ra != rb ? ra > rb : a.landmark < b.landmark;
  });
  const int columns = camera.width / kCell_px + 1, rows = camera.height / kCell_px + 1;
  std::vector<int> taken(static_cast<std::size_t>(columns * rows), 0);
  std::vector<std::pair<int, std::size_t>> order;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const int cell = static_cast<int>(seen[i].pixel.y()) / kCell_px * columns +
                     static_cast<int>(seen[i].pixel.x()) / kCell_px;
    order.emplace_back(taken[static_cast<std::size_t>(cell)]++, i);
  }
  std::stable_sort(order.begin(), order.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<Candidate> chosen;
  for (const auto& [rank, index] : order) {
    if (chosen.size() >= limit) break;
    chosen.push_back(seen[index]);
  }
  return chosen;
}

MapKeyframe& LocalMap::add_keyframe(MapKeyframe keyframe) {
  while (keyframes_.size() >= max_keyframes_) forget_oldest_keyframe();
  keyframe.identity = next_identity_++;
  for (const Sighting& sighting : keyframe.sightings) landmarks_[sighting.landmark].sightings += 1;
  keyframes_.push_back(std::move(keyframe));
  if (keyframes_.size() > kSurfacesKept) {
    MapKeyframe& old = keyframes_[keyframes_.size() - 1 - kSurfacesKept];
    old.surface = SurfaceGrid{};
  }
  return keyframes_.back();
}

std::optional<std::size_t> LocalMap::add_landmark(const MapLandmark& landmark) {
  while (alive_ >= max_landmarks_ && keyframes_.size() > 2) forget_oldest_keyframe();
  if (alive_ >= max_landmarks_) return std::nullopt;
  std::size_t index = landmarks_.size();
  if (free_.empty()) {
    landmarks_.push_back(landmark);
  } else {
    index = free_.back();
    free_.pop_back();
    landmarks_[index] = landmark;
  }
  landmarks_[index].identity = next_landmark_++;
  landmarks_[index].alive = true;
  ++alive_;
  return index;
}

void LocalMap::forget_landmark(std::size_t index) {
  landmarks_[index].alive = false;
  --alive_;
  free_.push_back(index);
}

void LocalMap::drop_dead_sightings() {
  for (MapKeyframe& keyframe : keyframes_)
    std::erase_if(keyframe.sightings, [&](const Sighting& s) { return !landmarks_[s.landmark].alive; });
}

void LocalMap::forget_unproven() {
  if (keyframes_.empty()) return;
  const std::size_t newest = keyframes_.back().identity;
  bool any = false;
  for (std::size_t i = 0; i < landmarks_.size(); ++i) {
    const MapLandmark& landmark = landmarks_[i];
    if (!landmark.alive) continue;
    const bool rarely_found = landmark.looked_for >= kTrialLooks && found_ratio(landmark) < kMinFoundRatio;
    const bool never_again = landmark.sightings < 2 && landmark.anchor + kYoungKeyframes <= newest;
    if (!rarely_found && !never_again) continue;
    forget_landmark(i);
    any = true;
  }
  if (any) drop_dead_sightings();
}

bool LocalMap::reanchor(std::size_t index) {
  for (auto keyframe = keyframes_.rbegin(); keyframe != keyframes_.rend(); ++keyframe)
    for (const Sighting& sighting : keyframe->sightings)
      if (sighting.landmark == index) {
        landmarks_[index].anchor = keyframe->identity;
        landmarks_[index].anchor_pixel = sighting.image_pixel;
        return true;
      }
  return false;
}

void LocalMap::forget_oldest_keyframe() {
  if (keyframes_.empty()) return;
  const MapKeyframe oldest = std::move(keyframes_.front());
  keyframes_.pop_front();
  for (const Sighting& sighting : oldest.sightings) {
    MapLandmark& landmark = landmarks_[sighting.landmark];
    if (!landmark.alive) continue;
    landmark.sightings -= 1;
    if (landmark.anchor == oldest.identity && !reanchor(sighting.landmark))
      forget_landmark(sighting.landmark);
  }
  for (MapKeyframe& keyframe : keyframes_)
    std::erase_if(keyframe.factors, [&](const SurfaceFactor& f) { return f.reference == oldest.identity; });
}

/// Whether every index and identity names something that is there.
bool LocalMap::is_sound() const {
  if (alive_ + free_.size() != landmarks_.size()) return false;
  std::vector<bool> is_free(landmarks_.size(), false);
  for (const std::size_t index : free_) {
    if (index >= landmarks_.size() || landmarks_[index].alive || is_free[index]) return false;
    is_free[index] = true;
  }
  std::size_t last = 0;
  for (const MapKeyframe& keyframe : keyframes_) {
    if (keyframe.identity <= last || keyframe.identity >= next_identity_) return false;
    last = keyframe.identity;
    for (const Sighting& sighting : keyframe.sightings)
      if (sighting.landmark >= landmarks_.size() || !landmarks_[sighting.landmark].alive) return false;
    for (const SurfaceFactor& factor : keyframe.factors)
      if (find(factor.reference) == nullptr) return false;
  }
  return std::all_of(landmarks_.begin(), landmarks_.end(), [this](const MapLandmark& landmark) {
    return !landmark.alive || (landmark.identity < next_landmark_ && find(landmark.anchor) != nullptr);
  });
}

Result<void> LocalMap::restore(
    const std::function<Result<void>(MapKeyframe&, bool with_surface)>& restore_keyframe) {
  if (!is_sound())
    return fail(ErrorCode::kCorrupted, "model of odometry",
                "its landmarks and keyframes do not belong together");
  for (std::size_t i = 0; i < keyframes_.size(); ++i)
    if (const auto restored = restore_keyframe(keyframes_[i], i + kSurfacesKept >= keyframes_.size());
        !restored)
      return restored;
  return {};
}

void LocalMap::clear() {
  landmarks_.clear();
  free_.clear();
  keyframes_.clear();
  alive_ = 0;
}

}  // namespace hm
