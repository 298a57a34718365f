#include "hm/odometry/published/frame_to_frame.hpp"

#include "hm/core/check.hpp"

namespace hm {

std::vector<PointPair> point_pairs(const FeatureSet& a, const FeatureSet& b,
                                   std::span<const FeatureMatch> matches) {
  std::vector<PointPair> pairs;
  pairs.reserve(matches.size());
  for (const FeatureMatch& match : matches) {
    const Feature& in_a = a[static_cast<std::size_t>(match.a)];
    const Feature& in_b = b[static_cast<std::size_t>(match.b)];
    HM_CHECK(in_a.has_depth && in_b.has_depth, "features {} and {}", match.a, match.b);
    pairs.push_back({in_a.p_camera, in_b.p_camera, in_a.covariance, in_b.covariance});
  }
  return pairs;
}

FrameMotion match_frames(const FeatureSet& a, const FeatureSet& b, const FrameMatchParams& params, Rng& rng) {
  MatchLimits limits = params.limits;
  limits.only_with_depth = true;
  const std::vector<FeatureMatch> matches = match_descriptors(a, b, limits);
  const std::vector<PointPair> pairs = point_pairs(a, b, matches);
  return {ransac_registration(pairs, params.ransac, rng), static_cast<int>(matches.size())};
}

}  // namespace hm
