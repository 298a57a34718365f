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

constexpr double kFree_m = 1;  // a direction that deviates by more is free
/// The next keyframe's loop is no independent one.
constexpr std::size_t kLeastApart = 2;
/// Deviations between two loops at most; those of the graph between their ends, in part per metre.
constexpr double kAgreementSigmas = 3, kChain_m = 0.1, kChainRatio = 0.02, kChain_rad = 0.03;
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

}  // namespace

bool is_free(const Mat3& covariance) { return covariance.topLeftCorner<2, 2>().trace() > kFree_m * kFree_m; }

bool determines_place(const PoseEdge2D& loop) { return !is_free(loop.information.inverse()); }

bool loops_agree(const PoseEdge2D& a, const PoseEdge2D& b, std::span<const SE2> T_map) {
  const auto apart = [](std::size_t i, std::size_t j) { return i > j ? i - j : j - i; };
  if (b.kind != PoseEdgeKind::kLoop || apart(a.to, b.to) > kReachOfAgreement ||
      apart(a.to, b.to) < kLeastApart || apart(a.from, b.from) > 2 * kReachOfAgreement ||
      !determines_place(a) || !determines_place(b))
    return false;
  const SE2 from = T_map[a.from].inverse() * T_map[b.from], to = T_map[b.to].inverse() * T_map[a.to];
  const PoseEdge2D around{b.from, b.to, from.inverse() * a.T_from_to * to.inverse(), b.information};
  const Vec3 error = pose_edge_error(around, SE2(), b.T_from_to);
  const double way_m = from.translation().norm() + to.translation().norm(),
               chain_m = kChain_m + kChainRatio * way_m;
  // The axes of a loop's error are those at its end.
  const Mat3 covariance = b.information.inverse() +
                          turned_covariance(to.rotation(), a.information.inverse()) +
                          Mat3(Vec3(chain_m, chain_m, kChain_rad).cwiseAbs2().asDiagonal());
  return error.dot(covariance.inverse() * error) <= kAgreementSigmas * kAgreementSigmas;
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
