#include "hm/slam/laser/loop_consistency.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "hm/core/statistics.hpp"
#include "hm/geometry/planar_covariance.hpp"

namespace hm {
namespace {

/// The next keyframe's loop is no independent one.
constexpr std::size_t kLeastApart = 2;
/// Deviations between two loops at most; those of the graph between their ends, in part per metre.
constexpr double kAgreementSigmas = 3, kChain_m = 0.1, kChainRatio = 0.02, kChain_rad = 0.03;
/// Two loops with larger deviations are different hypotheses: rooms side by side are farther apart.
constexpr double kSame_m = 0.6, kSame_rad = 0.15;
/// Keyframes on both ways, the distance up to which two are compared, and with how many at most.
constexpr std::size_t kTrail = 15, kWay = 25, kMostOnWay = 4;
constexpr double kTrailReach_m = 4;
/// Points that must agree, and what may contradict of those that both show.
constexpr std::size_t kMinAgreesOnTrail = 100;
constexpr double kMaxContradictedByTrail = 0.12;

ScanAgreement compare_trail(const MappedKeyframes& path, std::size_t from, const SE2& T_from_base) {
  const auto& [keyframes, T_map] = path;
  const std::size_t newest = keyframes.size() - 1, trail = newest - std::min(newest, kTrail);
  const SE2 T_new_old = T_map[from] * T_from_base * T_map[newest].inverse();
  const std::size_t way = from - std::min(from, kWay),
                    end = std::min(from + kWay, trail - std::min(trail, kLeastApart));
  ScanAgreement sum;
  for (std::size_t i = trail; i <= newest; ++i) {
    const SE2 T_map_i = T_new_old * T_map[i];
    std::vector<std::size_t> near;
    for (std::size_t k = way; k < end; ++k)
      if ((T_map[k].translation() - T_map_i.translation()).norm() < kTrailReach_m) near.push_back(k);
    for (const std::size_t k : thinned(std::move(near), kMostOnWay))
      compare_scans(keyframes[k].scan, keyframes[i].scan, T_map[k].inverse() * T_map_i, kVisitLimits, sum);
  }
  return sum;
}

/// Motion between the ends of another loop by one loop and the path between the two.
struct PredictedLoop {
  SE2 T_from_to;  ///< between the ends of the other
  SE2 T_to_to;    ///< from the other's end to the loop's
  double way_m;
};

template <class PoseOf>
PredictedLoop predict_loop(const PoseEdge2D& loop, const PoseEdge2D& other, const PoseOf& pose_of) {
  const SE2 from = pose_of(loop.from).inverse() * pose_of(other.from),
            to = pose_of(other.to).inverse() * pose_of(loop.to);
  return {from.inverse() * loop.T_from_to * to.inverse(), to,
          from.translation().norm() + to.translation().norm()};
}

}  // namespace

bool is_free(const Mat3& covariance) { return covariance.topLeftCorner<2, 2>().trace() > kFree_m * kFree_m; }

bool determines_place(const PoseEdge2D& loop) { return !is_free(loop.information.inverse()); }

bool loops_agree(const PoseEdge2D& a, const PoseEdge2D& b, std::span<const SE2> T_map) {
  if (b.kind != PoseEdgeKind::kLoop || keyframes_apart(a.to, b.to) > kReachOfAgreement ||
      keyframes_apart(a.to, b.to) < kLeastApart || keyframes_apart(a.from, b.from) > 2 * kReachOfAgreement ||
      !determines_place(a) || !determines_place(b))
    return false;
  const PredictedLoop predicted = predict_loop(a, b, [&](std::size_t k) { return T_map[k]; });
  const PoseEdge2D edge{b.from, b.to, predicted.T_from_to, b.information};
  const Vec3 error = pose_edge_error(edge, SE2(), b.T_from_to);
  const double chain_m = kChain_m + kChainRatio * predicted.way_m;
  // The axes of a loop's error are those at its end.
  const Mat3 covariance = b.information.inverse() +
                          turned_covariance(predicted.T_to_to.rotation(), a.information.inverse()) +
                          Mat3(Vec3(chain_m, chain_m, kChain_rad).cwiseAbs2().asDiagonal());
  return error.dot(covariance.inverse() * error) <= kAgreementSigmas * kAgreementSigmas;
}

bool same_hypothesis(const PoseEdge2D& a, const PoseEdge2D& b, std::span<const GraphKeyframe2D> keyframes) {
  if (keyframes_apart(a.to, b.to) > kReachOfAgreement || keyframes_apart(a.from, b.from) > kReachOfAgreement)
    return false;
  const auto pose_of = [&](std::size_t k) { return keyframes[k].T_odom_base; };
  const SE2 error = predict_loop(a, b, pose_of).T_from_to.inverse() * b.T_from_to;
  return error.translation().norm() < kSame_m && std::abs(error.angle()) < kSame_rad;
}

bool trail_agrees(const MappedKeyframes& path, std::size_t from, const SE2& T_from_base) {
  const ScanAgreement trail = compare_trail(path, from, T_from_base);
  return trail.agrees >= kMinAgreesOnTrail && trail.contradicted_ratio() <= kMaxContradictedByTrail;
}

double contradicted_on_way(const MappedKeyframes& path, std::size_t from) {
  const auto& T_map = path.T_map;
  const ScanAgreement as_it_is = compare_trail(path, from, T_map[from].inverse() * T_map.back());
  const bool is_little = as_it_is.agrees + as_it_is.seen_through < kMinAgreesOnTrail;
  return is_little ? 0 : as_it_is.contradicted_ratio();
}

}  // namespace hm
