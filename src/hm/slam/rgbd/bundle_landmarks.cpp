#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <utility>

#include "hm/core/statistics.hpp"
#include "hm/slam/rgbd/bundle_adjustment.hpp"

namespace hm {
namespace {

/// Maximum distance of a feature from the observation of the same landmark.
constexpr double kSameSpot_px = 1.5;
// These limits keep the number of observations proportional to the number of keyframes, however often a place
// is visited.
constexpr int kMostObservationsByLinks = 6;    // per landmark of odometry
constexpr int kMostLandmarksOfFeature = 3;     // of odometry; limits how often a feature's error counts
constexpr std::size_t kMostObservations = 60;  // per landmark

/// Disjoint sets of features; a set's number is that of its first member.
class FeatureSets {
 public:
  explicit FeatureSets(std::size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), std::size_t{0});
  }
  std::size_t set_of(std::size_t feature) {
    while (parent_[feature] != feature) feature = parent_[feature] = parent_[parent_[feature]];
    return feature;
  }
  void merge(std::size_t a, std::size_t b) {
    a = set_of(a);
    b = set_of(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::size_t> parent_;
};

BundleObservation observation_of(std::uint32_t keyframe, const LandmarkObservation& seen,
                                 const LandmarkNoise& noise) {
  return {keyframe, seen.pixel, seen.pixel_covariance, seen.depth_m,
          noise.shared_depth_ratio * std::sqrt(seen.depth_variance_m2)};
}

BundleObservation observation_of(std::uint32_t keyframe, const Feature& feature, const LandmarkNoise& noise) {
  const double variance = noise.feature_sigma_px * noise.feature_sigma_px;
  BundleObservation seen{keyframe, feature.pixel, variance * Eigen::Matrix2d::Identity(), 0, 0};
  if (!feature.has_depth) return seen;
  seen.depth_m = feature.p_camera.z();
  seen.depth_sigma_m = noise.shared_depth_ratio * std::sqrt(feature.covariance(2, 2));
  return seen;
}

/// Observations of odometry's landmarks in a keyframe, as refined by the next keyframe if that is available.
std::span<const LandmarkObservation> newest_observations_of(std::span<const Keyframe* const> keyframes,
                                                            std::uint32_t k) {
  const Keyframe* next = k + 1 < keyframes.size() ? keyframes[k + 1] : nullptr;
  const bool is_refined =
      next != nullptr && next->before && next->before->frame_index == keyframes[k]->frame_index;
  return is_refined ? next->before->observations : keyframes[k]->observations;
}

using Tracks = std::map<std::uint64_t, std::vector<BundleObservation>>;

bool is_seen_by(const std::vector<BundleObservation>& track, std::uint32_t keyframe) {
  return std::any_of(track.begin(), track.end(),
                     [keyframe](const BundleObservation& seen) { return seen.keyframe == keyframe; });
}

/// Collects the observations of odometry's landmarks and of landmarks created by links.
class TrackMaker {
 public:
  TrackMaker(std::span<const Keyframe* const> keyframes, const LandmarkNoise& noise)
      : keyframes_(keyframes),
        noise_(noise),
        landmark_of_(keyframes.size()),
        first_(first_features(keyframes)),
        sets_(first_.back()),
        linked_(first_.back(), false),
        landmarks_of_(first_.back(), 0) {
    for (std::uint32_t k = 0; k < keyframes.size(); ++k)
      for (const LandmarkObservation& seen : newest_observations_of(keyframes, k))
        of_odometry_[seen.landmark].push_back(observation_of(k, seen, noise));
  }

  void add(const FeatureLink& link) {
    const std::uint64_t of_a = landmark_of(link.keyframe_a, link.feature_a),
                        of_b = landmark_of(link.keyframe_b, link.feature_b);
    if (of_a != 0) return see(of_a, link.keyframe_b, link.feature_b);
    if (of_b != 0) return see(of_b, link.keyframe_a, link.feature_a);
    const std::size_t a = first_[link.keyframe_a] + link.feature_a,
                      b = first_[link.keyframe_b] + link.feature_b;
    sets_.merge(a, b);
    linked_[a] = linked_[b] = true;
  }

  Tracks take_of_odometry() { return std::move(of_odometry_); }

  /// Tracks of linked features without landmarks of odometry. Tracks with two features of a keyframe are
  /// ambiguous and dropped.
  Tracks of_links() {
    Tracks tracks;
    for (std::uint32_t k = 0; k < keyframes_.size(); ++k)
      for (std::size_t f = first_[k]; f < first_[k + 1]; ++f)
        if (linked_[f])
          tracks[sets_.set_of(f)].push_back(
              observation_of(k, keyframes_[k]->features[f - first_[k]], noise_));
    std::erase_if(tracks, [](const auto& entry) {
      const auto& track = entry.second;
      return std::adjacent_find(track.begin(), track.end(), [](const auto& a, const auto& b) {
               return a.keyframe == b.keyframe;
             }) != track.end();
    });
    return tracks;
  }

 private:
  static std::vector<std::size_t> first_features(std::span<const Keyframe* const> keyframes) {
    std::vector<std::size_t> first{0};
    for (const Keyframe* keyframe : keyframes) first.push_back(first.back() + keyframe->features.size());
    return first;
  }

  void see(std::uint64_t landmark, std::uint32_t keyframe, std::uint32_t feature) {
    int &by_links = observations_by_links_[landmark], &of_feature = landmarks_of_[first_[keyframe] + feature];
    if (by_links >= kMostObservationsByLinks || of_feature >= kMostLandmarksOfFeature) return;
    std::vector<BundleObservation>& track = of_odometry_[landmark];
    if (is_seen_by(track, keyframe)) return;
    track.push_back(observation_of(keyframe, keyframes_[keyframe]->features[feature], noise_));
    ++by_links;
    ++of_feature;
  }

  /// Id of odometry's landmark at a feature; 0: none.
  std::uint64_t landmark_of(std::uint32_t keyframe, std::uint32_t feature) {
    std::vector<std::uint64_t>& known = landmark_of_[keyframe];
    if (known.empty())
      for (const Feature& one : keyframes_[keyframe]->features) known.push_back(nearest(keyframe, one));
    return known[feature];
  }

  [[nodiscard]] std::uint64_t nearest(std::uint32_t keyframe, const Feature& feature) const {
    std::uint64_t landmark = 0;
    double least = kSameSpot_px * kSameSpot_px;
    for (const LandmarkObservation& seen : newest_observations_of(keyframes_, keyframe))
      if (const double apart = (seen.pixel - feature.pixel).squaredNorm(); apart < least) {
        least = apart;
        landmark = seen.landmark;
      }
    return landmark;
  }

  std::span<const Keyframe* const> keyframes_;
  LandmarkNoise noise_;
  Tracks of_odometry_;
  std::map<std::uint64_t, int> observations_by_links_;
  std::vector<std::vector<std::uint64_t>> landmark_of_;  ///< by keyframe (if linked) and feature
  std::vector<std::size_t> first_;                       ///< index of each keyframe's first feature
  FeatureSets sets_;
  std::vector<bool> linked_;
  std::vector<int> landmarks_of_;  ///< number of odometry landmarks that links have added each feature to
};

/// Mean of the positions from observations with depth, weighted by information; nothing without depth.
std::optional<Vec3> place_of(const Bundle& bundle, const std::vector<BundleObservation>& track) {
  const PinholeCamera& camera = bundle.camera;
  Mat3 weights = Mat3::Zero();
  Vec3 sum = Vec3::Zero();
  for (const BundleObservation& seen : track) {
    if (!(seen.depth_m > 0) || !(seen.depth_sigma_m > 0)) continue;
    Mat3 by_reading;  // derivative of the position with respect to [u; v; depth]
    by_reading << seen.depth_m / camera.fx, 0, (seen.pixel.x() - camera.cx) / camera.fx,  //
        0, seen.depth_m / camera.fy, (seen.pixel.y() - camera.cy) / camera.fy,            //
        0, 0, 1;
    Mat3 noise = Mat3::Zero();
    noise.topLeftCorner<2, 2>() = seen.pixel_covariance;
    noise(2, 2) = seen.depth_sigma_m * seen.depth_sigma_m;
    const SE3& T_map_camera = bundle.T_map_camera[seen.keyframe];
    const Mat3 turned = T_map_camera.rotation() * by_reading;
    const Mat3 weight = (turned * noise * turned.transpose()).inverse();
    weights += weight;
    sum += weight * (T_map_camera * camera.unproject(seen.pixel, seen.depth_m));
  }
  const Vec3 place = weights.inverse() * sum;
  if (!place.allFinite()) return std::nullopt;
  return place;
}

void take_over(Bundle& bundle, Tracks tracks) {
  for (auto& [number, track] : tracks) {
    if (track.size() < 2) continue;
    const std::optional<Vec3> place = place_of(bundle, track);
    if (!place) continue;
    std::sort(track.begin(), track.end(),
              [](const auto& a, const auto& b) { return a.keyframe < b.keyframe; });
    bundle.landmarks.push_back({*place, thinned(std::move(track), kMostObservations)});
  }
}

}  // namespace

void make_landmarks(Bundle& bundle, std::span<const Keyframe* const> keyframes,
                    std::span<const FeatureLink> links, const LandmarkNoise& noise) {
  TrackMaker maker(keyframes, noise);
  for (const FeatureLink& link : links) maker.add(link);
  bundle.landmarks.clear();
  take_over(bundle, maker.take_of_odometry());
  take_over(bundle, maker.of_links());
}

}  // namespace hm
