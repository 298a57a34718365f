#include "hm/odometry/registration/relocalisation.hpp"

#include <algorithm>
#include <cmath>

#include "hm/odometry/feature/descriptor_matching.hpp"
#include "hm/odometry/registration/pose_equations.hpp"

namespace hm {
namespace {

constexpr std::uint64_t kSeed = 4;
constexpr int kMaxDistance_bits = 64;
constexpr std::size_t kPlacesPerFrame = 4;  // at 30 Hz
constexpr double kFrame_s = 1.0 / 30, kMostFrames = 15;

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

std::optional<Relocalisation> find_again(std::span<const KnownPlace> places, const FeatureSet& features,
                                         const RelocalisationSearch& search, int& best_matches) {
  best_matches = 0;
  RansacParams params;
  params.inlier_test = InlierTest::kMahalanobis;
  params.min_inliers = search.min_inliers;
  std::optional<Relocalisation> best;
  for (std::size_t i = 0; i < std::min(search.count, places.size()); ++i) {
    const KnownPlace& place = places[places.size() - 1 - (search.first + i) % places.size()];
    const auto pairs = pairs_of(*place.features, features);
    best_matches = std::max(best_matches, static_cast<int>(pairs.size()));
    if (static_cast<int>(pairs.size()) < search.min_inliers) continue;
    Rng rng(kSeed, place.identity);
    const RansacMotion motion = ransac_registration(pairs, params, rng);
    const int inliers = static_cast<int>(motion.inliers.size());
    if (!motion.found || (best && inliers <= best->inliers)) continue;
    best = {place.T_odom_camera * motion.T_a_b, place.identity, inliers,
            covariance_by_adjoint(motion.covariance, place.T_odom_camera)};
  }
  return best;
}

void sort_by_view(std::vector<KnownPlace>& places, const SE3& T_odom_camera) {
  constexpr double kLikeARadian_m = 2;  // a way that changes the view of a room as much as a turn by a radian
  const auto change = [&](const KnownPlace& place) {
    const SE3 motion = T_odom_camera.inverse() * place.T_odom_camera;
    return motion.angle() + motion.translation().norm() / kLikeARadian_m;
  };
  std::stable_sort(places.begin(), places.end(),
                   [&](const KnownPlace& a, const KnownPlace& b) { return change(a) > change(b); });
}

RelocalisationSearch LostState::next_search(Time stamp, Time posed, int min_inliers) {
  const double passed_s = (stamp - (lost() ? last_ : posed)).seconds();
  const auto frames = static_cast<std::size_t>(std::clamp(std::round(passed_s / kFrame_s), 1.0, kMostFrames));
  const RelocalisationSearch search{searched_, frames * kPlacesPerFrame, min_inliers};
  searched_ += search.count;
  return search;
}

void LostState::count(Time stamp) {
  if (frames_++ == 0) since_ = stamp;
  last_ = stamp;
}

}  // namespace hm
