#pragma once
#include <cstddef>
#include <span>

#include "hm/geometry/pose_graph_2d.hpp"
#include "hm/slam/laser/scan_agreement.hpp"
#include "hm/slam/laser/scan_submaps.hpp"

namespace hm {

/// Keyframes and where the graph has them.
struct MappedKeyframes {
  std::span<const GraphKeyframe2D> keyframes;
  std::span<const SE2> T_map;
};

/// Two scans of one place, at different visits.
inline constexpr ScanAgreementLimits kVisitLimits{0.15, 0.02, 12, 90};
/// Loops that agree begin and end at most so many keyframes from each other.
inline constexpr std::size_t kReachOfAgreement = 15;

/// A direction whose deviation is larger is free.
inline constexpr double kFree_m = 1;

/// Number of keyframes from one to another.
inline std::size_t keyframes_apart(std::size_t i, std::size_t j) { return i > j ? i - j : j - i; }
/// Whether the covariance of (x, y, angle) leaves a direction free.
bool is_free(const Mat3& covariance);
/// Whether a loop holds the place in all directions, and not only between the walls of a corridor.
bool determines_place(const PoseEdge2D& loop);
/// Whether two loops between the same two stretches of the path fit one correction.
bool loops_agree(const PoseEdge2D& a, const PoseEdge2D& b, std::span<const SE2> T_map);
/// Whether two loops between the same two stretches of the path fit each other, up to 0.6 m and 0.15 rad, by
/// what odometry measured between them: an optimised graph is bent until its loops agree.
bool same_hypothesis(const PoseEdge2D& a, const PoseEdge2D& b, std::span<const GraphKeyframe2D> keyframes);
/// Whether the newest keyframes, moved so that the last one lies there relative to an earlier one, agree with
/// those of the way about that one: rooms look alike more often than the corridors to them, with their doors.
bool trail_agrees(const MappedKeyframes& path, std::size_t from, const SE2& T_from_base);
/// Share of what the newest keyframes, as the graph has them, and those of the way about an earlier one show
/// of each other that contradicts; 0 where that is little.
double contradicted_on_way(const MappedKeyframes& path, std::size_t from);

}  // namespace hm
