#pragma once
#include <span>
#include <string>

#include "hm/evaluation/trajectory_error.hpp"
#include "hm/report/html_report.hpp"
#include "hm/report/plot.hpp"

namespace hm {

/// Adds the estimated path from above, coloured by its position error, with a bar of the colours. "Above" as
/// in add_path_views().
void add_error_path(HtmlReport& report, const TrajectoryError& error);

/// Adds x, y, z (metres) and roll, pitch, yaw (degrees, Rz Ry Rx of the world's axes, unwrapped over time) of
/// the truth and of the aligned estimate over time: six plots. The orientations are those aligned on their
/// own where the positions do not determine them.
void add_pose_components(HtmlReport& report, const TrajectoryError& error);

/// Adds the table of mean, median, RMSE, 95 % and maximum: position after and before the alignment,
/// orientation after both alignments, relative error over a second; rows without values are left out, and a
/// note says why the orientation is.
void add_error_statistics(HtmlReport& report, const TrajectoryError& error);

/// Adds the histogram of the position error, millimetres.
void add_position_histogram(HtmlReport& report, const TrajectoryError& error);

/// A sentence on why the orientation error is not given; empty where it is determined.
std::string undetermined_rotation_note(const TrajectoryError& error);

/// Adds speed (m/s) and turn rate (rad/s) between consecutive poses over time, from the first one's
/// beginning; what is not physical is marked (set_aside_unphysical()). Of many poses, the fastest of each
/// few.
void add_motion_plots(HtmlReport& report, std::span<const NamedTrajectory> paths);

}  // namespace hm
