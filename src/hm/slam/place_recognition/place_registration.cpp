#include "hm/slam/place_recognition/place_registration.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "hm/core/rng.hpp"
#include "hm/geometry/pose_graph_3d.hpp"
#include "hm/geometry/solvers/small_solvers.hpp"

namespace hm {
namespace {

constexpr std::uint64_t kRansacSeed = 331;
constexpr int kRefinements = 5;
/// Minimum distance between a sample's points; closer points do not determine the rotation.
constexpr double kMinSampleDistance_m = 0.1;

Mat3 match_covariance(const Feature& a, const Feature& b, const Mat3& rotation) {
  return a.covariance + rotation * b.covariance * rotation.transpose();
}

/// Positions of a match for RANSAC.
struct MatchPoints {
  Vec3 a, b;
  double sigma_m;  ///< approximate standard deviation of the difference
};

std::vector<MatchPoints> points_of(const FeatureSet& a, const FeatureSet& b,
                                   std::span<const FeaturePair> matches) {
  std::vector<MatchPoints> points;
  points.reserve(matches.size());
  for (const auto& [i, j] : matches)
    points.push_back(
        {a[i].p_camera, b[j].p_camera, std::sqrt(a[i].covariance.trace() + b[j].covariance.trace())});
  return points;
}

/// True if two matches are consistent with a rigid motion: equal distances between their points in both
/// frames.
bool can_be_rigid(const MatchPoints& m, const MatchPoints& n, double cap_m) {
  const double in_a = (m.a - n.a).norm(), in_b = (m.b - n.b).norm();
  const double tolerance = std::min(2 * cap_m, 3 * (m.sigma_m + n.sigma_m));
  return std::abs(in_a - in_b) <= tolerance && std::min(in_a, in_b) >= kMinSampleDistance_m;
}

std::vector<FeaturePair> inliers_of(const FeatureSet& a, const FeatureSet& b,
                                    std::span<const FeaturePair> matches, const SE3& T_a_b,
                                    const PlaceVerifierParams& params) {
  std::vector<FeaturePair> inliers;
  const double cap2 = params.kMaxMatchDistance_m * params.kMaxMatchDistance_m;
  for (const FeaturePair& match : matches) {
    const Feature &fa = a[match.first], &fb = b[match.second];
    if ((fa.p_camera - T_a_b * fb.p_camera).squaredNorm() > cap2) continue;
    if (match_chi2(fa, fb, T_a_b) <= params.kMaxMatchChi2) inliers.push_back(match);
  }
  return inliers;
}

/// Number of samples for drawing three inliers with the given confidence.
double samples_needed(std::size_t inliers, std::size_t matches, double confidence) {
  const double share = static_cast<double>(inliers) / static_cast<double>(matches);
  const double all_good = share * share * share;
  if (all_good >= 1) return 1;
  return std::log(1 - confidence) / std::log(1 - all_good);
}

std::optional<std::array<std::size_t, 3>> draw(Rng& rng, const std::vector<MatchPoints>& points,
                                               double cap_m) {
  const auto count = static_cast<std::uint32_t>(points.size());
  const std::size_t i = rng.below(count), j = rng.below(count), k = rng.below(count);
  if (i == j || j == k || i == k) return std::nullopt;
  if (!can_be_rigid(points[i], points[j], cap_m) || !can_be_rigid(points[j], points[k], cap_m) ||
      !can_be_rigid(points[i], points[k], cap_m))
    return std::nullopt;
  const Vec3 side = points[j].a - points[i].a, other = points[k].a - points[i].a;
  if (side.cross(other).norm() < 0.1 * side.norm() * other.norm()) return std::nullopt;  // on a line
  return std::array<std::size_t, 3>{i, j, k};
}

/// Matches within the distance limit, in the given order; cheap, for ranking samples.
std::size_t count_near(const std::vector<MatchPoints>& points, const SE3& T_a_b,
                       const PlaceVerifierParams& params) {
  std::size_t near = 0;
  const double chi2 = params.kMaxMatchChi2, cap2 = params.kMaxMatchDistance_m * params.kMaxMatchDistance_m;
  for (const MatchPoints& m : points) {
    const double distance2 = (m.a - T_a_b * m.b).squaredNorm();
    if (distance2 <= cap2 && distance2 <= chi2 * m.sigma_m * m.sigma_m) ++near;
  }
  return near;
}

std::optional<SE3> best_sample(const std::vector<MatchPoints>& points, const PlaceVerifierParams& params) {
  Rng rng(kRansacSeed);
  std::optional<SE3> best;
  std::size_t most = 3;
  // Enough samples for the smallest acceptable inlier ratio.
  const auto wanted = static_cast<std::size_t>(
      std::max<double>(params.kMinSeeds, params.kMinSeedRatio * static_cast<double>(points.size())));
  double needed = samples_needed(std::min(wanted, points.size()), points.size(), params.kConfidenceRatio);
  for (int i = 0; i < params.kMaxIterations && i < needed; ++i) {
    const auto sample = draw(rng, points, params.kMaxMatchDistance_m);
    if (!sample) continue;
    std::array<Vec3, 3> p_a, p_b;
    for (std::size_t s = 0; s < 3; ++s) {
      p_a[s] = points[(*sample)[s]].a;
      p_b[s] = points[(*sample)[s]].b;
    }
    const SE3 T_a_b = *fit_motion(p_a, p_b);
    const std::size_t near = count_near(points, T_a_b, params);
    if (near <= most) continue;
    most = near;
    best = T_a_b;
    needed = std::min(needed, samples_needed(most, points.size(), params.kConfidenceRatio));
  }
  return best;
}

/// One step of weighted least squares over the inliers; returns their information.
Mat6 improve(const FeatureSet& a, const FeatureSet& b, std::span<const FeaturePair> inliers, SE3& T_a_b) {
  Mat6 information = Mat6::Zero();
  Vec6 gradient = Vec6::Zero();
  for (const auto& [i, j] : inliers) {
    const Mat3 weight = match_covariance(a[i], b[j], T_a_b.rotation()).inverse();
    const auto jacobian = match_jacobian(T_a_b, b[j].p_camera);
    information += jacobian.transpose() * weight * jacobian;
    gradient += jacobian.transpose() * (weight * (a[i].p_camera - T_a_b * b[j].p_camera));
  }
  const Vec6 move = solve_symmetric(information, -gradient);
  if (move.allFinite()) T_a_b = moved_by(T_a_b, move);
  return information;
}

}  // namespace

std::optional<SE3> fit_motion(std::span<const Vec3> p_a, std::span<const Vec3> p_b) {
  if (p_a.size() < 3 || p_a.size() != p_b.size()) return std::nullopt;
  Vec3 mean_a = Vec3::Zero(), mean_b = Vec3::Zero();
  const auto count = static_cast<double>(p_a.size());
  for (std::size_t i = 0; i < p_a.size(); ++i) {
    mean_a += p_a[i] / count;
    mean_b += p_b[i] / count;
  }
  Mat3 cross = Mat3::Zero();
  for (std::size_t i = 0; i < p_a.size(); ++i) cross += (p_a[i] - mean_a) * (p_b[i] - mean_b).transpose();
  const Svd3 svd = svd_of(cross);
  Mat3 mirror = Mat3::Identity();
  if (svd.U.determinant() * svd.V.determinant() < 0) mirror(2, 2) = -1;
  const Mat3 rotation = svd.U * mirror * svd.V.transpose();
  return SE3(rotation, mean_a - rotation * mean_b);
}

double match_chi2(const Feature& a, const Feature& b, const SE3& T_a_b) {
  const Vec3 apart = a.p_camera - T_a_b * b.p_camera;
  return apart.dot(match_covariance(a, b, T_a_b.rotation()).llt().solve(apart));
}

Eigen::Matrix<double, 3, 6> match_jacobian(const SE3& T_a_b, const Vec3& p_b) {
  Eigen::Matrix<double, 3, 6> jacobian;
  jacobian << -T_a_b.rotation(), T_a_b.rotation() * skew(p_b);
  return jacobian;
}

std::optional<MotionHypothesis> register_features(const FeatureSet& a, const FeatureSet& b,
                                                  std::span<const FeaturePair> matches,
                                                  const PlaceVerifierParams& params) {
  if (matches.size() < 4) return std::nullopt;
  const std::optional<SE3> sample = best_sample(points_of(a, b, matches), params);
  if (!sample) return std::nullopt;
  MotionHypothesis best;
  best.T_a_b = *sample;
  best.inliers = inliers_of(a, b, matches, best.T_a_b, params);
  for (int i = 0; i < kRefinements && best.inliers.size() >= 4; ++i) {
    best.information = improve(a, b, best.inliers, best.T_a_b);
    best.inliers = inliers_of(a, b, matches, best.T_a_b, params);
  }
  if (best.inliers.size() < 4) return std::nullopt;
  return best;
}

std::vector<FeaturePair> match_guided(const FeatureSet& a, const FeatureSet& b, const SE3& T_a_b,
                                      const PlaceVerifierParams& params) {
  constexpr std::uint32_t kNone = UINT32_MAX;
  struct Best {
    int bits;
    std::uint32_t other = UINT32_MAX;
  };
  std::vector<Best> of_a(a.size(), {params.kMaxGuidedBits + 1}), of_b(b.size(), {params.kMaxGuidedBits + 1});
  const double cap_m = params.kMaxMatchDistance_m;
  std::vector<std::pair<double, std::uint32_t>> by_x;
  for (std::uint32_t i = 0; i < a.size(); ++i)
    if (a[i].has_depth) by_x.emplace_back(a[i].p_camera.x(), i);
  std::sort(by_x.begin(), by_x.end());
  for (std::uint32_t j = 0; j < b.size(); ++j) {
    if (!b[j].has_depth) continue;
    const Vec3 expected = T_a_b * b[j].p_camera;
    auto near = std::lower_bound(by_x.begin(), by_x.end(), std::pair(expected.x() - cap_m, std::uint32_t{0}));
    for (; near != by_x.end() && near->first <= expected.x() + cap_m; ++near) {
      const std::uint32_t i = near->second;
      if ((a[i].p_camera - expected).squaredNorm() > cap_m * cap_m) continue;
      const int bits = hamming_distance(a[i].descriptor, b[j].descriptor);
      if (bits >= of_a[i].bits && bits >= of_b[j].bits) continue;
      if (match_chi2(a[i], b[j], T_a_b) > params.kMaxMatchChi2) continue;
      if (bits < of_a[i].bits) of_a[i] = {bits, j};
      if (bits < of_b[j].bits) of_b[j] = {bits, i};
    }
  }
  std::vector<FeaturePair> matches;
  for (std::uint32_t i = 0; i < a.size(); ++i)
    if (of_a[i].other != kNone && of_b[of_a[i].other].other == i) matches.emplace_back(i, of_a[i].other);
  return matches;
}

void refine_guided(const FeatureSet& a, const FeatureSet& b, const PlaceVerifierParams& params,
                   MotionHypothesis& hypothesis) {
  for (int round = 0; round < 2; ++round) {
    const std::vector<FeaturePair> guided = match_guided(a, b, hypothesis.T_a_b, params);
    if (guided.size() < hypothesis.inliers.size() && round == 0 && guided.size() < 4) return;
    for (int i = 0; i < 2; ++i) hypothesis.information = improve(a, b, guided, hypothesis.T_a_b);
    hypothesis.inliers = inliers_of(a, b, guided, hypothesis.T_a_b, params);
  }
}

double conflict_ratio(const FeatureSet& a, const FeatureSet& b, const SE3& T_a_b) {
  // Tolerances for sloping surfaces between features a few pixels apart.
  constexpr double kTolerance_m = 0.05, kToleranceRatio = 0.03, kNear_m = 0.3;
  int agreeing = 0, conflicting = 0;
  for (const Feature& feature : b) {
    if (!feature.has_depth) continue;
    const Vec3 p = T_a_b * feature.p_camera;
    if (p.z() < kNear_m) continue;
    const Vec2 direction = p.head<2>() / p.z();
    bool has_neighbour = false, agrees = false;
    for (const Feature& other : a) {
      if (!other.has_depth) continue;
      const Vec2 apart = other.p_camera.head<2>() / other.p_camera.z() - direction;
      if (apart.squaredNorm() > kSameDirection_rad * kSameDirection_rad) continue;
      has_neighbour = true;
      agrees |= std::abs(p.z() - other.p_camera.z()) < kTolerance_m + kToleranceRatio * p.z();
    }
    agreeing += has_neighbour && agrees ? 1 : 0;
    conflicting += has_neighbour && !agrees ? 1 : 0;
  }
  return agreeing + conflicting == 0 ? 0 : static_cast<double>(conflicting) / (agreeing + conflicting);
}

}  // namespace hm
