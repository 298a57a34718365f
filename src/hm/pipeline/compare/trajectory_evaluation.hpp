#pragma once
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "hm/evaluation/trajectory_error.hpp"
#include "hm/report/summary_tree.hpp"

namespace hm {

/// One of the trajectories that are compared with the same truth.
struct EvaluatedTrajectory {
  std::string name;  ///< the last parts of its path that differ from the others, "odometry" and "slam"
  std::filesystem::path path;
  TrajectoryError error;
};

/// Comparison of trajectories with one truth.
struct TrajectoryComparison {
  std::filesystem::path truth;
  std::vector<EvaluatedTrajectory> estimates;  ///< one or more, as given
  std::vector<std::string> warnings;           ///< including what the reader of a recording left out
};

/// Reads trajectories and compares each with the truth. Each is a file (TUM, EuRoC, KITTI) or the folder of a
/// recording: as an estimate it stands for the poses that its device reports, as truth for its
/// true_trajectory(). Warns where an estimate and the truth have one source: the same poses, or the result of
/// `hm reconstruct` with the poses that are now the truth; and where an estimate has another size.
/// Error where poses of one have stamps and those of the other do not; where neither has and their numbers
/// differ (pose i belongs to pose i; what is over a second is left out then).
Result<TrajectoryComparison> evaluate_trajectory_files(std::span<const std::filesystem::path> estimates,
                                                       const std::filesystem::path& truth,
                                                       const TrajectoryErrorParams& params);

/// ate_rmse_m, rpe_frame_m, rpe_second_m, rpe_metre_m, rpe_second_rad ... (those without a span are left
/// out), rpe_translation_rmse_m and rpe_rotation_rmse_rad over the parameters' span, pairs ...
void visit(const TrajectoryError& error, SummaryTree& v);
/// The same for one trajectory; for several `trajectories`, a list of them with `name` and `path`.
void visit(const TrajectoryComparison& comparison, SummaryTree& v);
/// Lines for a terminal: all of one trajectory, or a table of several.
std::string to_text(const TrajectoryComparison& comparison);

}  // namespace hm
