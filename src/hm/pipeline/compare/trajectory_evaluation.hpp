#pragma once
#include <filesystem>

#include "hm/evaluation/trajectory_error.hpp"
#include "hm/report/summary_tree.hpp"

namespace hm {

/// Reads two trajectories and compares them. Each is a file (TUM, EuRoC, KITTI) or the folder of a recording:
/// as an estimate it stands for the poses that its device reports, as truth for the true ones (for the only
/// ones where it has no others). `warnings` gets what the reader of a recording left out.
Result<TrajectoryError> evaluate_trajectory_files(const std::filesystem::path& estimate,
                                                  const std::filesystem::path& truth,
                                                  const TrajectoryErrorParams& params,
                                                  std::vector<std::string>& warnings);

/// ate_rmse_m, rpe_frame_m, rpe_second_m, rpe_metre_m, rpe_second_rad ... (those without a span are left
/// out), rpe_translation_rmse_m and rpe_rotation_rmse_rad over the parameters' span, pairs ...
void visit(const TrajectoryError& error, SummaryTree& v);
/// Lines for a terminal.
std::string to_text(const TrajectoryError& error);

/// A self-contained page with both paths and the errors over time.
std::string trajectory_report_html(const TrajectoryError& error, const std::string& title);

}  // namespace hm
