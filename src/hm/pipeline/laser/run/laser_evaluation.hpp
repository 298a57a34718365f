#pragma once
#include "hm/io/laser/laser_recording.hpp"
#include "hm/pipeline/laser/run/laser_run.hpp"

namespace hm {

/// Fills error and relation_error, and error_odom and relation_error_odom where the run was
/// corrected; what cannot be compared becomes a warning.
void evaluate_laser_run(const LaserRecording& recording, const LaserRunOptions& options,
                        LaserSummary& summary);

/// Number of loops of a graph that the truth contradicts: by more than four deviations of the loop, with 10
/// cm and 0.03 rad besides. Directions that a loop leaves free are not judged. Nothing where the truth
/// reaches none.
std::optional<std::size_t> count_wrong_loops(const ScanGraph2D& graph, const Trajectory& truth);

/// Shares of contradicted points from which on the map of a laser is doubtful or broken (docs/verdict.md). A
/// single place does not break a long run: a wall that is 0.3 m off contradicts as much as one that is 10 m
/// off.
inline constexpr VisitLimits kLaserVisitLimits{
    .window = 9, .doubtful_ratio = 0.25, .broken_ratio = 1, .broken_p95_ratio = 0.4, .window_m = 4.5};

/// Judges the result without truth: contradictions between visits of a place, scans without a pose, matching
/// that was lost, a doubtful place in a saved map, motion whose length was guessed, turns that differ from
/// those of odometry.
RunVerdict judge_laser_run(const LaserRecording& recording, const LaserSummary& summary,
                           const ScanVisits& visits, const LaserMapFrame& frame);

/// How far scan matching turns where odometry turns by one radian; negative: the other way. Over turns of 0.3
/// rad or 3 s. Nothing where odometry turns by less than 1 rad in all, or where the two are not alike at all.
std::optional<double> turn_ratio(const Trajectory& matched, const Trajectory& odometry);

}  // namespace hm
