#include "hm/odometry/tracker/tracker_keyframes.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>

#include "hm/core/statistics.hpp"
#include "hm/geometry/solvers/small_solvers.hpp"
#include "hm/odometry/feature/depth_uncertainty.hpp"
#include "hm/odometry/interface/frame_check.hpp"

namespace hm {
namespace {

constexpr double kAnchorSigma_px = 0.15;  // of a landmark in its own patch
constexpr double kFreeDistance_px = 14;   // between landmarks, for an image of 640 x 480
constexpr double kLastingShare =
    0.35;  // share of the sensor's standard deviation that averaging does not reduce
constexpr double kMinFusionSigmas = 3;  // readings beyond belong to another surface

std::vector<const Feature*> choose_new(const FeatureSet& features, const std::vector<Sighting>& sightings,
                                       double distance_px, std::size_t target) {
  std::vector<Vec2> taken;
  for (const Sighting& sighting : sightings) taken.push_back(sighting.pixel);
  std::vector<const Feature*> chosen;
  for (const Feature& feature : features) {
    if (!feature.has_depth) continue;
    if (taken.size() >= target) break;
    const bool crowded = std::any_of(taken.begin(), taken.end(), [&](const Vec2& pixel) {
      return (pixel - feature.pixel).squaredNorm() < distance_px * distance_px;
    });
    if (crowded) continue;
    taken.push_back(feature.pixel);
    chosen.push_back(&feature);
  }
  return chosen;
}

Vec3 normal_at(const MapKeyframe& keyframe, const Feature& feature) {
  const Vec2 cell = pixel_in_level(feature.pixel, 2);
  const int x = static_cast<int>(std::lround(cell.x())), y = static_cast<int>(std::lround(cell.y()));
  const auto& elements = keyframe.surface.elements;
  if (elements.contains(x, y) && elements(x, y).sigma_m > 0) return elements(x, y).normal.cast<double>();
  return -feature.p_camera.normalized();
}

void add_landmark(LocalMap& map, MapKeyframe& keyframe, const Feature& feature, const PinholeCamera& camera,
                  const RowMotion& rows) {
  const Mat3& R = keyframe.T_odom_camera.rotation();
  const DepthGaussian depth{feature.p_camera.z(), feature.covariance(2, 2)};
  MapLandmark landmark;
  landmark.p_odom = keyframe.T_odom_camera * feature.p_camera;
  landmark.covariance = R * feature_covariance(camera, feature.pixel, depth, kAnchorSigma_px) * R.transpose();
  landmark.normal_odom = R * normal_at(keyframe, feature);
  landmark.anchor = keyframe.identity;
  landmark.anchor_pixel = rows.in_image(feature.pixel, depth.mean_m);
  landmark.sightings = 1;
  const auto index = map.add_landmark(landmark);
  if (!index) return;
  const Mat2 pixel_covariance = Mat2::Identity() * kAnchorSigma_px * kAnchorSigma_px;
  keyframe.sightings.push_back(
      {*index, feature.pixel, pixel_covariance, depth.mean_m, depth.variance_m2, landmark.anchor_pixel});
}

/// Observations of the landmarks of a keyframe with the refined depths so far.
std::vector<LandmarkObservation> observations_of(const LocalMap& map, const MapKeyframe& keyframe) {
  std::vector<LandmarkObservation> observations;
  for (const Sighting& s : keyframe.sightings)
    observations.push_back(
        {map.landmark(s.landmark).identity, s.pixel, s.pixel_covariance, s.depth_m, s.depth_variance_m2});
  return observations;
}

}  // namespace

bool keyframe_due(const TrackerParams& params, const SE3& T_keyframe_camera, int inliers, int best_inliers,
                  double depth_m) {
  return inliers < params.kKeyframeInlierRatio * best_inliers ||
         T_keyframe_camera.angle() > params.kKeyframeAngle_rad ||
         T_keyframe_camera.translation().norm() > params.kKeyframeDistanceRatio * depth_m;
}

std::shared_ptr<Keyframe> insert_keyframe(LocalMap& map, KeyframeParts parts, const PinholeCamera& camera,
                                          const RegistrationParams& params, std::size_t target_landmarks) {
  const RgbdFrame& frame = *parts.frame->frame;
  auto record = std::make_shared<Keyframe>();
  record->frame_index = frame.index;
  record->stamp = frame.stamp;
  record->submap = parts.submap;
  record->T_odom_camera = parts.T_odom_camera;
  record->features = std::move(parts.features);
  record->motion_covariance = parts.motion_covariance;
  MapKeyframe keyframe;
  keyframe.T_odom_camera = parts.T_odom_camera;
  keyframe.covariance = parts.covariance;
  keyframe.pyramid = parts.frame->pyramid;
  keyframe.grid = parts.frame->grid;
  keyframe.surface = make_surface_grid(parts.frame->grid, params.noise);
  keyframe.record = record;
  const RowMotion rows = parts.frame->motion.rows_at(parts.T_odom_camera);
  keyframe.motion = parts.frame->motion.motion_at(parts.T_odom_camera);
  if (!rows.is_zero()) keyframe.T_camera_depth = rows.T_camera_depth();
  for (const LandmarkMatch& match : parts.matches) {
    const PointObservation& o = match.observation;
    if (match.inlier)
      keyframe.sightings.push_back(
          {match.landmark, o.pixel, o.pixel_covariance, o.depth_m, o.depth_variance_m2, match.image_pixel});
  }
  if (!map.empty()) {
    const MapKeyframe& before = map.keyframes().back();
    record->before = {before.record->frame_index, observations_of(map, before)};
    keyframe.factors.push_back(
        parts.covariance_since_last
            ? SurfaceFactor{before.identity, before.T_odom_camera.inverse() * parts.T_odom_camera,
                            inverse_of(*parts.covariance_since_last), Vec6::Zero()}
            : surface_factor(before, parts.frame->grid, parts.T_odom_camera, rows, params));
    if (parts.frame->prior && keyframe.sightings.empty() && !parts.covariance_since_last)
      keyframe.factors.push_back(prior_factor(before, *parts.frame->prior));
    else if (parts.turn)
      keyframe.factors.push_back(turn_factor(before, *parts.turn, parts.T_odom_camera));
  }
  const double distance_px = kFreeDistance_px * camera.width / 640.0;
  const auto chosen = choose_new(record->features, keyframe.sightings, distance_px, target_landmarks);
  MapKeyframe& added = map.add_keyframe(std::move(keyframe));
  for (const Feature* feature : chosen) add_landmark(map, added, *feature, camera, rows);
  record->observations = observations_of(map, added);
  return record;
}

std::optional<EndOfDrift> end_of_drift(const LocalMap& map, const DepthArrival& arrival,
                                       const SE3& T_odom_model) {
  const MapKeyframe& keyframe = map.keyframes().back();
  std::map<std::size_t, int> sighted;  // landmarks of earlier keyframes
  for (const Sighting& sighting : keyframe.sightings)
    if (const std::size_t anchor = map.landmark(sighting.landmark).anchor; anchor != keyframe.identity)
      ++sighted[anchor];
  const MapKeyframe* known = nullptr;
  int most = 0;
  for (const auto& [anchor, count] : sighted)
    if (const MapKeyframe* found = count > most ? map.find(anchor) : nullptr) known = found, most = count;
  if (!known) return std::nullopt;
  return EndOfDrift{T_odom_model * arrival.T_odom_camera, arrival.covariance, known->record->frame_index,
                    known->T_odom_camera.inverse() * keyframe.T_odom_camera};
}

std::vector<SurfaceReference> surface_references(const LocalMap& map) {
  std::vector<SurfaceReference> references;
  for (const MapKeyframe& keyframe : map.keyframes())
    references.push_back({keyframe.identity, keyframe.T_odom_camera * keyframe.T_camera_depth.value_or(SE3{}),
                          Mat6::Zero(), &keyframe.grid});
  return references;
}

std::shared_ptr<Keyframe> make_depth_keyframe(const KeyframeParts& parts) {
  auto record = std::make_shared<Keyframe>();
  record->frame_index = parts.frame->frame->index;
  record->stamp = parts.frame->frame->stamp;
  record->submap = parts.submap;
  record->T_odom_camera = parts.T_odom_camera;
  record->motion_covariance = parts.motion_covariance;
  return record;
}

FeatureSet at_middle_row(FeatureSet features, const TrackerFrame& frame, const SE3& T_odom_camera,
                         const PinholeCamera& camera, const OdometryParams& params, double unknown_depth_m) {
  const RowMotion rows = frame.motion.rows_at(T_odom_camera);
  if (rows.is_zero()) return features;
  for (Feature& feature : features) {
    const double depth_m = feature.has_depth ? feature.p_camera.z() : unknown_depth_m;
    feature.pixel = rows.at_middle_row(feature.pixel, depth_m);
    Feature in_depth_image = feature;
    in_depth_image.pixel = rows.in_depth_image(feature.pixel, depth_m);
    place_in_space(in_depth_image, frame.frame->depth, camera, params.features,
                   {params.max_depth_m, params.max_depth_sigma_m});
    feature.has_depth = in_depth_image.has_depth;
    if (!feature.has_depth) continue;
    feature.p_camera = camera.unproject(
        feature.pixel, rows.depth_at_middle_row(in_depth_image.pixel, in_depth_image.p_camera.z()));
    feature.covariance = in_depth_image.covariance;
  }
  std::erase_if(features, [&camera](const Feature& f) { return !camera.contains(f.pixel); });
  return features;
}

void retime_keyframe(LocalMap& map, const InstantMotion& motion, const ColorTimes& times,
                     const PinholeCamera& camera) {
  MapKeyframe& keyframe = map.keyframes().back();
  keyframe.motion = motion;
  const RowMotion rows(camera, times, motion);
  if (rows.is_zero()) return;
  // What the surfaces have shown is the motion between the depth images.
  const SE3 T_old_new = keyframe.T_camera_depth.value_or(SE3{}) * rows.T_camera_depth().inverse();
  for (SurfaceFactor& factor : keyframe.factors) factor.linearised_at = factor.linearised_at * T_old_new;
  keyframe.T_camera_depth = rows.T_camera_depth();
  for (Sighting& sighting : keyframe.sightings) {
    MapLandmark& landmark = map.landmark(sighting.landmark);
    const double depth_m =
        sighting.depth_m > 0 ? sighting.depth_m : (keyframe.T_odom_camera.inverse() * landmark.p_odom).z();
    sighting.pixel = rows.at_middle_row(sighting.image_pixel, depth_m);
    if (landmark.anchor == keyframe.identity && landmark.sightings == 1 && sighting.depth_m > 0)
      landmark.p_odom = keyframe.T_odom_camera * camera.unproject(sighting.pixel, depth_m);
  }
}

void fuse_depths(LocalMap& map, const std::vector<LandmarkMatch>& matches, const SE3& T_odom_camera,
                 const PinholeCamera& camera, const DepthNoise& noise) {
  MapKeyframe& keyframe = map.keyframes().back();
  const SE3 T_key_camera = keyframe.T_odom_camera.inverse() * T_odom_camera;
  // Both have a few hundred elements, in different orders.
  std::vector<std::pair<std::size_t, Sighting*>> sighted;
  for (Sighting& sighting : keyframe.sightings) sighted.emplace_back(sighting.landmark, &sighting);
  std::sort(sighted.begin(), sighted.end());
  for (const LandmarkMatch& match : matches) {
    const PointObservation& o = match.observation;
    if (!match.inlier || !(o.depth_m > 0)) continue;
    const auto at = std::lower_bound(sighted.begin(), sighted.end(),
                                     std::pair(match.landmark, static_cast<Sighting*>(nullptr)));
    if (at == sighted.end() || at->first != match.landmark) continue;
    Sighting& sighting = *at->second;
    const double z = (T_key_camera * camera.unproject(o.pixel, o.depth_m)).z();
    if (!(sighting.depth_m > 0)) continue;
    const double variance = sighting.depth_variance_m2 + o.depth_variance_m2;
    const double difference = z - sighting.depth_m;
    if (difference * difference > kMinFusionSigmas * kMinFusionSigmas * variance) continue;
    const double gain = sighting.depth_variance_m2 / variance;
    const double floor_m = kLastingShare * noise.sigma_m(z);
    sighting.depth_m += gain * difference;
    sighting.depth_variance_m2 = std::max(sighting.depth_variance_m2 * (1 - gain),
                                          std::min(sighting.depth_variance_m2, floor_m * floor_m));
  }
}

int count_with_depth(const FeatureSet& features) {
  return static_cast<int>(std::ranges::count_if(features, [](const Feature& f) { return f.has_depth; }));
}

std::vector<KnownPlace> known_places(const LocalMap& map) {
  std::vector<KnownPlace> places;
  for (const MapKeyframe& keyframe : map.keyframes())
    places.push_back({&keyframe.record->features, keyframe.T_odom_camera, keyframe.identity});
  return places;
}

Result<void> complete_keyframe(MapKeyframe& keyframe, bool with_surface, const OdometryHistory& history,
                               const PinholeCamera& camera, const DepthNoise& noise, double max_depth_m) {
  const std::size_t index = keyframe.record->frame_index;
  keyframe.record = history.find_keyframe(index);
  if (!keyframe.record)
    return fail(ErrorCode::kCorrupted, "state of odometry", "frame {} is no keyframe", index);
  const auto frame = read_again(index, camera, history);
  if (!frame) return forward_error(frame);
  TrackerFrame view = make_tracker_frame(*frame, camera, noise, max_depth_m);
  keyframe.pyramid = std::move(view.pyramid);
  keyframe.grid = view.grid;
  if (with_surface) keyframe.surface = make_surface_grid(view.grid, noise);
  return {};
}

std::optional<double> median_depth_m(const FeatureSet& features) {
  std::vector<double> depths;
  for (const Feature& feature : features)
    if (feature.has_depth) depths.push_back(feature.p_camera.z());
  if (depths.empty()) return std::nullopt;
  return middle_value(std::span(depths));
}

}  // namespace hm
