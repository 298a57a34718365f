#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include "hm/slam/rgbd/bundle_adjustment.hpp"

namespace hm {
namespace {

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

LandmarkObservation observation_of(std::uint32_t keyframe, const Feature& feature) {
  LandmarkObservation sight{keyframe, feature.pixel, 0, 0};
  if (!feature.has_depth) return sight;
  sight.depth_m = feature.p_camera.z();
  sight.depth_sigma_m = std::sqrt(feature.covariance(2, 2));
  return sight;
}

/// Mean of the places that keyframes with depth give, weighted by their information.
class WeightedPlace {
 public:
  void add(const SE3& T_map_camera, const Feature& feature) {
    if (!feature.has_depth) return;
    const Mat3 turned = T_map_camera.rotation() * feature.covariance * T_map_camera.rotation().transpose();
    const Mat3 weight = turned.inverse();
    weights_ += weight;
    sum_ += weight * (T_map_camera * feature.p_camera);
  }
  [[nodiscard]] Vec3 mean() const { return weights_.inverse() * sum_; }

 private:
  Mat3 weights_ = Mat3::Zero();
  Vec3 sum_ = Vec3::Zero();
};

bool sees_twice(const Landmark& landmark) {
  for (std::size_t i = 1; i < landmark.observations.size(); ++i)
    if (landmark.observations[i].keyframe == landmark.observations[i - 1].keyframe) return true;
  return false;
}

}  // namespace

std::vector<Landmark> make_landmarks(std::span<const Keyframe* const> keyframes,
                                     std::span<const SE3> T_map_camera, std::span<const FeatureLink> links) {
  std::vector<std::size_t> first(keyframes.size() + 1, 0);
  for (std::size_t k = 0; k < keyframes.size(); ++k) first[k + 1] = first[k] + keyframes[k]->features.size();
  FeatureSets sets(first.back());
  std::vector<bool> linked(first.back(), false);
  for (const FeatureLink& link : links) {
    const std::size_t a = first[link.keyframe_a] + link.feature_a,
                      b = first[link.keyframe_b] + link.feature_b;
    sets.merge(a, b);
    linked[a] = linked[b] = true;
  }
  std::map<std::size_t, std::pair<Landmark, WeightedPlace>> by_set;
  for (std::uint32_t k = 0; k < keyframes.size(); ++k)
    for (std::size_t f = first[k]; f < first[k + 1]; ++f) {
      if (!linked[f]) continue;
      const Feature& feature = keyframes[k]->features[f - first[k]];
      auto& [landmark, place] = by_set[sets.set_of(f)];
      landmark.observations.push_back(observation_of(k, feature));
      place.add(T_map_camera[k], feature);
    }
  std::vector<Landmark> landmarks;
  for (auto& [set, entry] : by_set) {
    auto& [landmark, place] = entry;
    if (landmark.observations.size() < 2 || sees_twice(landmark)) continue;
    landmark.p_map = place.mean();
    if (landmark.p_map.allFinite()) landmarks.push_back(std::move(landmark));
  }
  return landmarks;
}

}  // namespace hm
