#include "hm/odometry/tracker_relocalisation.hpp"

#include <algorithm>

#include "hm/odometry/descriptor_matching.hpp"

namespace hm {
namespace {

constexpr std::uint64_t kSeed = 4;
constexpr int kMaxDistance_bits = 64;

std::vector<PointPair> pairs_of(const FeatureSet& a, const FeatureSet& b) {
  MatchLimits limits;
  limits.max_distance_bits = kMaxDistance_bits;
  limits.mutual = true;
  std::vector<PointPair> pairs;
  for (const FeatureMatch& match : match_descriptors(a, b, limits)) {
    const Feature& fa = a[static_cast<std::size_t>(match.a)];
    const Feature& fb = b[static_cast<std::size_t>(match.b)];
    pairs.push_back({fa.p_camera, fb.p_camera, fa.covariance, fb.covariance});
  }
  return pairs;
}

}  // namespace

std::optional<Relocalisation> find_again(const LocalMap& map, const FeatureSet& features,
                                         const RelocalisationSearch& search, int& best_matches) {
  best_matches = 0;
  const auto& keyframes = map.keyframes();
  RansacParams params;
  params.inlier_test = InlierTest::kMahalanobis;
  params.min_inliers = search.min_inliers;
  std::optional<Relocalisation> best;
  for (std::size_t i = 0; i < std::min(search.count, keyframes.size()); ++i) {
    const MapKeyframe& keyframe = keyframes[keyframes.size() - 1 - (search.first + i) % keyframes.size()];
    const auto pairs = pairs_of(keyframe.record->features, features);
    best_matches = std::max(best_matches, static_cast<int>(pairs.size()));
    if (static_cast<int>(pairs.size()) < search.min_inliers) continue;
    Rng rng(kSeed, keyframe.identity);
    const RansacMotion motion = ransac_registration(pairs, params, rng);
    const int inliers = static_cast<int>(motion.inliers.size());
    if (motion.found && (!best || inliers > best->inliers))
      best = {keyframe.T_odom_camera * motion.T_a_b, keyframe.identity, inliers};
  }
  return best;
}

}  // namespace hm
