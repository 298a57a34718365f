#include "hm/pipeline/compare/trajectory_report.hpp"

#include <algorithm>
#include <array>

#include "hm/core/angle.hpp"
#include "hm/core/text/counted.hpp"
#include "hm/report/html_report.hpp"
#include "hm/report/path_plots.hpp"
#include "hm/report/plot.hpp"
#include "hm/report/run_report.hpp"
#include "hm/report/trajectory_plots.hpp"

namespace hm {
namespace {

void add_one(HtmlReport& report, const TrajectoryError& error) {
  const SummaryTree tree = describe(error);
  report.set_verdict(
      HtmlReport::Verdict::kNone,
      *tree.sentence("The path of {truth_path_m} is off by {ate_rmse_m} (rmse of {pairs|position})."));
  add_cards(report, tree,
            {{"ATE", "{ate_rmse_m}", "rmse after alignment"},
             {"RPE", "{rpe_second_m}", "rmse, a second"},
             {"RPE", "{rpe_second_rad}", "rmse, a second"}});
}

void add_sections_of_one(HtmlReport& report, const TrajectoryError& error) {
  const Trajectory truth = matched_truth(error), estimate = matched_estimate(error);
  report.begin_section("Path");
  const std::array<NamedTrajectory, 2> paths{{{"truth", &truth}, {"estimate", &estimate}}};
  add_path_views(report, paths, "The estimate is fitted to the truth.");
  report.begin_section("Error");
  add_error_statistics(report, error);
  add_error_path(report, error);
  add_position_histogram(report, error);
  report.begin_section("Relative errors", "Of the motion over spans of one length, not divided by it.");
  add_relative_table(report, error);
  report.begin_section("Over time");
  add_error_plots(report, error);
  report.begin_section("Pose over time", "The estimate is fitted to the truth.");
  add_pose_components(report, error);
  add_motion_plots(report, paths);
}

const EvaluatedTrajectory& best_of(const TrajectoryComparison& comparison) {
  return *std::ranges::min_element(comparison.estimates, {}, [](const EvaluatedTrajectory& estimate) {
    return estimate.error.position_m.rmse;
  });
}

using Rows = std::vector<std::vector<std::string>>;

Rows position_rows(const TrajectoryComparison& comparison, Summary TrajectoryError::*errors) {
  Rows rows;
  for (const EvaluatedTrajectory& estimate : comparison.estimates) {
    std::vector<std::string> row{estimate.name, with_thousands(estimate.error.pairs)};
    const Summary& values = estimate.error.*errors;
    for (const double value : {values.mean, values.median, values.rmse, values.max})
      row.push_back(fmt::format("{:.4f}", value));
    rows.push_back(std::move(row));
  }
  return rows;
}

/// Orientation and relative errors (rmse); "-" where there is none.
Rows other_rows(const TrajectoryComparison& comparison) {
  Rows rows;
  const auto text = [](bool there, double value, int digits) {
    return there ? fmt::format("{:.{}f}", value, digits) : std::string("-");
  };
  for (const auto& [name, path, error] : comparison.estimates) {
    const bool second = !error.per_second.spans.empty(), metre = !error.per_metre.spans.empty();
    rows.push_back({name, text(!error.rotation_undetermined, error.rotation_rad.rmse * kDegreesPerRadian, 3),
                    text(true, error.rotation_own_rad.rmse * kDegreesPerRadian, 3),
                    text(!error.per_frame.spans.empty(), error.per_frame.translation_m.rmse, 4),
                    text(second, error.per_second.translation_m.rmse, 4),
                    text(second, error.per_second.rotation_rad.rmse * kDegreesPerRadian, 3),
                    text(metre, error.per_metre.translation_m.rmse, 4)});
  }
  return rows;
}

void add_tables(HtmlReport& report, const TrajectoryComparison& comparison) {
  const std::vector<std::string> header{"trajectory", "poses", "mean", "median", "RMSE", "largest"};
  report.begin_section("Position error", "In metres, each trajectory fitted to the truth on its own.");
  report.add_table(header, position_rows(comparison, &TrajectoryError::position_m));
  report.begin_section("Position error without alignment", "In metres, of the poses as the files have them.");
  report.add_table(header, position_rows(comparison, &TrajectoryError::position_given_m));
  report.begin_section("Orientation and relative errors",
                       "RMSE. Orientation after the alignment by positions (- where they do not determine "
                       "it), and after orientations were aligned on their own; motion over a frame, a second "
                       "and a metre.");
  report.add_table({"trajectory", "orientation (deg)", "on its own (deg)", "frame (m)", "second (m)",
                    "second (deg)", "metre (m)"},
                   other_rows(comparison));
}

constexpr std::size_t kPlotColors = 8;  // --s0 to --s7

void add_sections_of_several(HtmlReport& report, const TrajectoryComparison& comparison) {
  const auto& estimates = comparison.estimates;
  // The truth of the one that covers most of it; each one's true poses are at its own stamps.
  const EvaluatedTrajectory& longest = *std::ranges::max_element(
      estimates, {}, [](const EvaluatedTrajectory& estimate) { return estimate.error.truth_path_m; });
  const Trajectory truth = matched_truth(longest.error);
  const Time begin = truth.front().stamp;
  std::vector<Trajectory> fitted;
  std::vector<PlotSeries> errors;
  for (const EvaluatedTrajectory& estimate : estimates) {
    fitted.push_back(matched_estimate(estimate.error));
    PlotSeries series{
        estimate.name,
        {},
        estimate.error.position_errors_m,
        SeriesStyle::kLine,
        fmt::format("var(--s{})", fitted.size() % kPlotColors)};  // as beside the truth, the first
    for (const PosePair& pair : estimate.error.matched) series.x.push_back((pair.stamp - begin).seconds());
    errors.push_back(std::move(series));
  }
  std::vector<NamedTrajectory> paths{{"truth", &truth}};
  for (std::size_t i = 0; i < fitted.size(); ++i) paths.push_back({estimates[i].name, &fitted[i]});
  add_tables(report, comparison);
  report.begin_section("Paths");
  add_path_views(report, paths, "Each trajectory is fitted to the truth.");
  report.begin_section("Over time");
  PlotOptions plot;
  plot.x.label = "time (s)", plot.y.label = "position error (m)";
  report.add_svg(plot_svg(errors, plot), "Position error of each trajectory, fitted to the truth.");
  report.begin_section("Motion");
  add_motion_plots(report, paths);
}

}  // namespace

std::string trajectory_report_html(const TrajectoryComparison& comparison, const std::string& title) {
  HtmlReport report(title);
  if (comparison.estimates.size() == 1) {
    add_one(report, comparison.estimates.front().error);
    add_warnings_section(report, comparison.warnings);
    add_sections_of_one(report, comparison.estimates.front().error);
    return report.html();
  }
  const EvaluatedTrajectory& best = best_of(comparison);
  report.set_verdict(HtmlReport::Verdict::kNone,
                     fmt::format("Of {} trajectories, {} is nearest to the truth: off by {:.4f} m (rmse).",
                                 comparison.estimates.size(), best.name, best.error.position_m.rmse));
  add_warnings_section(report, comparison.warnings);
  add_sections_of_several(report, comparison);
  return report.html();
}

}  // namespace hm
