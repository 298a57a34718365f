#include "hm/report/path_plots.hpp"

#include <array>

#include "hm/core/angle.hpp"
#include "hm/report/render/mesh_renderer.hpp"

namespace hm {
namespace {

constexpr std::array<const char*, 3> kAxisNames{"x", "y", "z"};

/// View against the direction `up`, without mirroring: right x up in the plot points to the viewer.
PaperAxes seen_from(const Vec3& up) {
  int axis = 2;
  up.cwiseAbs().maxCoeff(&axis);
  PaperAxes paper{(axis + 1) % 3, (axis + 2) % 3};
  if (up[axis] < 0) std::swap(paper.right, paper.up);
  return paper;
}

int axis_upwards(const Vec3& up) {
  int axis = 2;
  up.cwiseAbs().maxCoeff(&axis);
  return axis;
}

/// Transforms a path so that x and y for trajectory_svg() are the two plot axes.
Trajectory on_paper(const Trajectory& path, const PaperAxes& paper) {
  Trajectory flat;
  for (const StampedPose& pose : path) {
    const Vec3& p = pose.T_world_base.translation();
    flat.push_back({pose.stamp, SE3(Mat3::Identity(), Vec3(p[paper.right], p[paper.up], 0))});
  }
  return flat;
}

void add_view(HtmlReport& report, std::span<const NamedTrajectory> paths, const PaperAxes& paper,
              const std::string& caption) {
  std::vector<Trajectory> flat;
  std::vector<NamedTrajectory> named;
  for (const NamedTrajectory& path : paths) flat.push_back(on_paper(*path.trajectory, paper));
  for (std::size_t i = 0; i < paths.size(); ++i) named.push_back({paths[i].name, &flat[i]});
  PlotOptions plot;
  plot.equal_aspect = true;
  plot.height_px = 360;
  plot.x.label = std::string(kAxisNames[static_cast<std::size_t>(paper.right)]) + " (m)";
  plot.y.label = std::string(kAxisNames[static_cast<std::size_t>(paper.up)]) + " (m)";
  report.add_svg(trajectory_svg(named, plot), caption);
}

PlotSeries over_time(const RelativeErrors& errors, std::string name, Time begin) {
  PlotSeries series{std::move(name), {}, {}, SeriesStyle::kLine};
  for (const RelativeError& span : errors.spans) {
    series.x.push_back((span.stamp - begin).seconds());
    series.y.push_back(span.translation_m);
  }
  return series;
}

std::string span_name(const RelativeErrors& errors) {
  std::string_view unit = kRpeUnitNames[static_cast<std::size_t>(errors.unit)];
  if (errors.delta == 1) unit.remove_suffix(1);
  return fmt::format("{:g} {}", errors.delta, unit);
}

}  // namespace

PaperAxes paper_axes(const Trajectory& path) { return seen_from(up_of_cameras(path)); }

void add_path_views(HtmlReport& report, std::span<const NamedTrajectory> paths, const std::string& caption) {
  if (paths.empty() || paths.front().trajectory->empty()) return;
  const Vec3 up = up_of_cameras(*paths.front().trajectory);
  const PaperAxes above = seen_from(up);
  add_view(report, paths, above, "From above. " + caption);
  add_view(report, paths, {above.right, axis_upwards(up)}, "From the side. " + caption);
}

void add_frame_plot(HtmlReport& report, std::span<const PlotSeries> series, const char* y_label,
                    const std::string& caption) {
  PlotOptions plot;
  plot.x.label = "frame", plot.y.label = y_label;
  report.add_svg(plot_svg(series, plot), caption);
}

Trajectory matched_truth(const TrajectoryError& error) {
  Trajectory path;
  for (const PosePair& pair : error.matched) path.push_back({pair.stamp, pair.T_world_truth});
  return path;
}

Trajectory matched_estimate(const TrajectoryError& error) {
  Trajectory path;
  for (const PosePair& pair : error.matched) path.push_back({pair.stamp, pair.T_world_estimate});
  return path;
}

void add_error_plots(HtmlReport& report, const TrajectoryError& error) {
  if (error.matched.empty()) return;
  const Time begin = error.matched.front().stamp;
  PlotSeries position{"position error", {}, error.position_errors_m, SeriesStyle::kLine};
  for (const PosePair& pair : error.matched) position.x.push_back((pair.stamp - begin).seconds());
  PlotOptions plot;
  plot.x.label = "time (s)", plot.y.label = "error (m)";
  report.add_svg(plot_svg(std::span(&position, 1), plot), "Absolute position error.");
  std::vector<PlotSeries> relative;
  if (!error.per_second.spans.empty())
    relative.push_back(over_time(error.per_second, "over 1 second", begin));
  else
    relative.push_back(over_time(error.per_frame, "over 1 frame", begin));
  const bool own = error.relative.unit != RpeUnit::kSeconds || error.relative.delta != 1;
  if (own) relative.push_back(over_time(error.relative, "over " + span_name(error.relative), begin));
  report.add_svg(plot_svg(relative, plot), "Relative translation error of the spans that begin there.");
}

void add_relative_table(HtmlReport& report, const TrajectoryError& error) {
  std::vector<std::vector<std::string>> rows;
  const auto add = [&](const RelativeErrors& errors) {
    if (errors.spans.empty()) return;
    rows.push_back({span_name(errors), std::to_string(errors.spans.size()),
                    fmt::format("{:.4f}", errors.translation_m.rmse),
                    fmt::format("{:.4f}", errors.translation_m.median),
                    fmt::format("{:.4f}", errors.translation_m.max),
                    fmt::format("{:.3f}", errors.rotation_rad.rmse * kDegreesPerRadian),
                    fmt::format("{:.3f}", errors.rotation_rad.max * kDegreesPerRadian)});
  };
  add(error.per_frame);
  add(error.per_second);
  add(error.per_metre);
  if (error.relative.delta != 1) add(error.relative);
  report.add_table({"span", "spans", "rmse (m)", "median (m)", "max (m)", "rmse (deg)", "max (deg)"}, rows);
}

}  // namespace hm
