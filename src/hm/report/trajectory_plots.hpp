#pragma once
#include "hm/evaluation/trajectory_error.hpp"
#include "hm/report/html_report.hpp"

namespace hm {

/// Adds the estimated path from above, coloured by its position error, with a bar of the colours. "Above" as
/// in add_path_views().
void add_error_path(HtmlReport& report, const TrajectoryError& error);

/// Adds x, y, z (metres) and roll, pitch, yaw (degrees, Rz Ry Rx of the world's axes, unwrapped over time) of
/// the truth and of the aligned estimate over time: six plots.
void add_pose_components(HtmlReport& report, const TrajectoryError& error);

/// Adds the table of mean, median, RMSE, 95 % and maximum: position after and before the alignment,
/// orientation, relative error over a second; rows without values are left out.
void add_error_statistics(HtmlReport& report, const TrajectoryError& error);

/// Adds the histogram of the position error, millimetres.
void add_position_histogram(HtmlReport& report, const TrajectoryError& error);

/// The position errors of the matched poses as they were before the estimate was aligned, metres.
std::vector<double> unaligned_position_errors_m(const TrajectoryError& error);

}  // namespace hm
