#include "hm/slam/rgbd/covisibility_matches.hpp"

#include <algorithm>

#include "hm/core/statistics.hpp"
#include "hm/slam/place_recognition/place_registration.hpp"

namespace hm {
namespace {

constexpr std::size_t kSamples = 24;    // number of features sampled per keyframe
constexpr double kMinShared = 0.25;     // minimum share of them in the other view
constexpr double kMinViewCosine = 0.5;  // between the viewing directions of a point, since descriptors change
constexpr double kLinkMinDepth_m = 0.1;
constexpr std::size_t kMinMatches = 12;  // fewer may be due to chance

/// Evenly selected points of a keyframe, camera frame.
std::vector<Vec3> sample_of(const Keyframe& keyframe) {
  std::vector<Vec3> points;
  for (const Feature& feature : keyframe.features)
    if (feature.has_depth) points.push_back(feature.p_camera);
  return thinned(std::move(points), kSamples);
}

/// True if many of b's points are inside the image of a and seen from a similar direction.
bool shares_view(const PinholeCamera& camera, const std::vector<Vec3>& points_b, const SE3& T_a_b) {
  const auto is_shared = [&](const Vec3& p_b) {
    const Vec3 p_a = T_a_b * p_b, ray_b = T_a_b.rotation() * p_b;
    const bool is_from_same_side = p_a.dot(ray_b) > kMinViewCosine * p_a.norm() * ray_b.norm();
    return is_from_same_side && p_a.z() > kLinkMinDepth_m && camera.contains(camera.project(p_a));
  };
  const auto shared = static_cast<double>(std::ranges::count_if(points_b, is_shared));
  return shared > kMinShared * static_cast<double>(points_b.size());
}

}  // namespace

std::vector<KeyframePair> pairs_of_visits(std::span<const PlacedKeyframe> placed,
                                          const PinholeCamera& camera) {
  std::vector<KeyframePair> pairs;
  for (std::uint32_t b = 0; b < placed.size(); ++b) {
    const Keyframe& later = *placed[b].keyframe;
    const std::vector<Vec3> points = sample_of(later);
    std::vector<std::uint32_t> partners;
    for (std::uint32_t a = 0; a < b; ++a) {
      const bool is_near = b - a < kKeyframesApart && placed[a].keyframe->submap == later.submap;
      if (is_near || placed[a].map != placed[b].map) continue;
      if (shares_view(camera, points, placed[a].T_map_camera.inverse() * placed[b].T_map_camera))
        partners.push_back(a);
    }
    for (const std::uint32_t a : thinned(std::move(partners), kMostVisits)) pairs.emplace_back(a, b);
  }
  return pairs;
}

std::vector<FeatureLink> match_covisible(std::span<const PlacedKeyframe> placed, const PinholeCamera& camera,
                                         const PlaceVerifierParams& params,
                                         std::span<const KeyframePair> linked) {
  std::vector<FeatureLink> links;
  for (const auto& [a, b] : pairs_of_visits(placed, camera)) {
    if (std::ranges::binary_search(linked, KeyframePair(a, b))) continue;
    const SE3 T_a_b = placed[a].T_map_camera.inverse() * placed[b].T_map_camera;
    const auto matches =
        match_guided(placed[a].keyframe->features, placed[b].keyframe->features, T_a_b, params);
    if (matches.size() < kMinMatches) continue;
    for (const auto& [feature_a, feature_b] : matches) links.push_back({a, feature_a, b, feature_b});
  }
  return links;
}

}  // namespace hm
