#pragma once
#include <span>

#include "hm/evaluation/trajectory_error.hpp"
#include "hm/report/html_report.hpp"
#include "hm/report/plot.hpp"

namespace hm {

/// Adds the paths from above and from the side (dissertation Fig. 3.12). The up axis is determined from the
/// first path's cameras: z of a world frame, or -y of the first camera's frame.
void add_path_views(HtmlReport& report, std::span<const NamedTrajectory> paths, const std::string& caption);

/// The axes of the frame that lie to the right and upwards on such a drawing from above.
struct PaperAxes {
  int right = 0, up = 1;
};
PaperAxes paper_axes(const Trajectory& path);

/// Adds lines over the frames' numbers.
void add_frame_plot(HtmlReport& report, std::span<const PlotSeries> series, const char* y_label,
                    const std::string& caption);

/// True poses and aligned estimated poses of the matched pairs.
Trajectory matched_truth(const TrajectoryError& error);
Trajectory matched_estimate(const TrajectoryError& error);

/// Adds the absolute error over time, and the relative ones over a second and over the parameters' own span.
void add_error_plots(HtmlReport& report, const TrajectoryError& error);

/// Adds the table of relative errors per frame, second and metre.
void add_relative_table(HtmlReport& report, const TrajectoryError& error);

}  // namespace hm
