#include "hm/pipeline/flight/mission/flight_report.hpp"

#include <array>
#include <cmath>

#include "hm/core/angle.hpp"
#include "hm/report/plot.hpp"
#include "hm/report/run_report.hpp"

namespace hm {
namespace {

using Getter = std::optional<double> (*)(const FlightSample&);

/// One value of each sample over time; a sample without it leaves a gap.
PlotSeries series_of(const FlightSummary& summary, std::string name, Getter get) {
  PlotSeries series;
  series.name = std::move(name);
  for (const FlightSample& sample : summary.log.samples()) {
    series.x.push_back(sample.time_s);
    series.y.push_back(get(sample).value_or(std::numeric_limits<double>::quiet_NaN()));
  }
  return series;
}

template <int kAxis>
std::optional<double> goal_of(const FlightSample& sample) {
  return sample.goal_m ? std::optional((*sample.goal_m)(kAxis)) : std::nullopt;
}
template <int kAxis>
std::optional<double> estimate_of(const FlightSample& sample) {
  return sample.estimate.position_m(kAxis);
}
template <int kAxis>
std::optional<double> truth_of(const FlightSample& sample) {
  return sample.truth.position_m(kAxis);
}
template <int kAxis>
std::optional<double> true_speed_of(const FlightSample& sample) {
  return sample.truth.velocity_m_s(kAxis);
}
template <int kAxis>
std::optional<double> estimated_speed_of(const FlightSample& sample) {
  return sample.estimate.velocity_m_s(kAxis);
}
template <int kAxis>
std::optional<double> error_cm_of(const FlightSample& sample) {
  constexpr double kCm = 100;
  return kCm * (sample.estimate.position_m(kAxis) - sample.truth.position_m(kAxis));
}
std::optional<double> true_yaw_of(const FlightSample& sample) {
  return sample.truth.yaw_rad * kDegreesPerRadian;
}
std::optional<double> estimated_yaw_of(const FlightSample& sample) {
  return sample.estimate.yaw_rad * kDegreesPerRadian;
}
std::optional<double> tilt_of(const FlightSample& sample) { return sample.tilt_rad * kDegreesPerRadian; }
std::optional<double> battery_of(const FlightSample& sample) { return 100 * sample.battery_ratio; }

PlotOptions over_time(std::string label) {
  PlotOptions plot;
  plot.x.label = "time (s)";
  plot.y.label = std::move(label);
  return plot;
}

void add_plot(HtmlReport& report, std::initializer_list<PlotSeries> series, const PlotOptions& options,
              const char* caption) {
  report.add_svg(plot_svg(std::vector<PlotSeries>(series), options), caption);
}

void add_position_section(HtmlReport& report, const FlightSummary& summary) {
  report.begin_section("Position",
                       "Commanded, estimated on board and true, in the frame odom of the start. A goal is "
                       "drawn while the vehicle goes to or keeps a position.");
  constexpr std::array<Getter, 3> kGoal{goal_of<0>, goal_of<1>, goal_of<2>},
      kEstimate{estimate_of<0>, estimate_of<1>, estimate_of<2>},
      kTruth{truth_of<0>, truth_of<1>, truth_of<2>};
  constexpr std::array<const char*, 3> kLabels{"x (m)", "y (m)", "z (m)"};
  constexpr std::array<const char*, 3> kCaptions{"Forward of the start.", "To the left of the start.",
                                                 "Height over the floor of the start."};
  for (std::size_t k = 0; k < kLabels.size(); ++k) {
    PlotSeries goal = series_of(summary, "commanded", kGoal[k]);
    goal.style = SeriesStyle::kStep;
    add_plot(report,
             {std::move(goal), series_of(summary, "estimated", kEstimate[k]),
              series_of(summary, "true", kTruth[k])},
             over_time(kLabels[k]), kCaptions[k]);
  }
  add_plot(report,
           {series_of(summary, "estimated", estimated_yaw_of), series_of(summary, "true", true_yaw_of)},
           over_time("yaw (deg)"), "Heading.");
}

void add_path_section(HtmlReport& report, const FlightSummary& summary,
                      const FlightReportMaterial& material) {
  report.begin_section("Path");
  PlotOptions plot;
  plot.x.label = "x (m)", plot.y.label = "y (m)";
  plot.equal_aspect = true;
  plot.height_px = 360;
  PlotSeries goals{"way points", {}, {}, SeriesStyle::kScatter}, estimate{"estimated", {}, {}},
      truth{"true", {}, {}};
  for (const WayPointRecord& way_point : summary.log.way_points()) {
    goals.x.push_back(way_point.goal_m.x());
    goals.y.push_back(way_point.goal_m.y());
  }
  const auto add = [](PlotSeries& series, const Trajectory& path) {
    for (const StampedPose& pose : path) {
      series.x.push_back(pose.T_world_base.translation().x());
      series.y.push_back(pose.T_world_base.translation().y());
    }
  };
  add(estimate, summary.trajectory);
  add(truth, material.truth);
  std::vector<PlotSeries> series{std::move(estimate), std::move(truth)};
  if (!goals.x.empty()) series.push_back(std::move(goals));
  report.add_svg(plot_svg(series, plot), "From above.");
  for (const Figure& figure : material.figures) add_figure(report, figure);
}

void add_height_section(HtmlReport& report, const FlightSummary& summary) {
  PlotSeries height{"by the laser", {}, {}, SeriesStyle::kScatter},
      floor{"floor", {}, {}, SeriesStyle::kStep};
  for (const MeasuredHeight& measured : summary.heights) {
    const double time_s = (measured.stamp - summary.start).seconds();
    height.x.push_back(time_s), floor.x.push_back(time_s);
    height.y.push_back(measured.height_m), floor.y.push_back(measured.floor_m);
  }
  if (height.x.empty()) return;
  report.begin_section("Height", "From the beams that the mirror turns to the floor.");
  add_plot(report, {std::move(height), series_of(summary, "true", truth_of<2>), std::move(floor)},
           over_time("height (m)"),
           "Measured and true height, and the level of the floor below the vehicle.");
}

void add_motion_section(HtmlReport& report, const FlightSummary& summary) {
  report.begin_section("Motion");
  add_plot(report,
           {series_of(summary, "x, estimated", estimated_speed_of<0>),
            series_of(summary, "x, true", true_speed_of<0>),
            series_of(summary, "y, estimated", estimated_speed_of<1>),
            series_of(summary, "y, true", true_speed_of<1>)},
           over_time("velocity (m/s)"), "Velocity in the frame odom.");
  add_plot(report,
           {series_of(summary, "x", error_cm_of<0>), series_of(summary, "y", error_cm_of<1>),
            series_of(summary, "z", error_cm_of<2>)},
           over_time("error (cm)"), "Estimated minus true position.");
  add_plot(report, {series_of(summary, "tilt", tilt_of)}, over_time("tilt (deg)"), "True tilt.");
  add_plot(report, {series_of(summary, "charge", battery_of)}, over_time("charge (%)"),
           "Charge of the battery, as it is measured on board.");
}

void add_tables(HtmlReport& report, const SummaryTree& tree) {
  report.begin_section("Orders");
  add_list_table(report, tree, "orders");
  if (!tree.table("failsafes").rows.empty()) {
    report.begin_section("Fail-safes");
    add_list_table(report, tree, "failsafes");
  }
  report.begin_section("Events");
  add_list_table(report, tree, "events");
  report.begin_section("Latencies", "From the end of a scan's last beam to its pose, and on to the motors.");
  add_list_table(report, tree, "latencies");
  add_list_table(report, tree, "stages");
}

}  // namespace

std::string flight_report_html(const FlightSummary& summary, const FlightReportMaterial& material) {
  using Verdict = HtmlReport::Verdict;
  const SummaryTree tree = describe(summary);
  HtmlReport report(summary.mission, "Flight");
  const Verdict verdict = !mishap_of(summary).empty() ? Verdict::kBad
                          : summary.warnings.empty()  ? Verdict::kGood
                                                      : Verdict::kDoubtful;
  report.set_verdict(verdict,
                     *tree.sentence("{air_s} in the air over {path_length_m}, {collisions|collision}; in "
                                    "the end: {end_state}[. Hovering, it stayed within {hover.max_xy_m} "
                                    "in the plane and {hover.max_z_m} in height]."));
  add_cards(
      report, tree,
      {{"collisions", "{collisions}", "{end_state}"},
       {"hover", "{hover.max_xy_m}", "in the plane at most; in height {hover.max_z_m}"},
       {"way points", "{waypoints.reached}",
        "reached, {waypoints.missed} missed[; at most "
        "{waypoints.worst_m} off]"},
       {"path", "{path_length_m}", "at most {max_speed_m_s}"},
       {"estimate", "{estimate_error_m.rmse}", "RMS error of the position; {estimate_error_m.max} at most"},
       {"speed", "{realtime_ratio}", "times real time"}});
  add_warnings_section(report, summary.warnings);
  if (!material.flight_svg.empty()) {
    report.begin_section("Flight");
    report.add_svg(material.flight_svg, "The true path over the floor plan, and the height (m) over time.");
  }
  add_position_section(report, summary);
  add_path_section(report, summary, material);
  add_height_section(report, summary);
  add_motion_section(report, summary);
  add_tables(report, tree);
  return page_with_parameters(report, material.parameters_toml, material.program_version);
}

JsonValue flight_report_json(const FlightSummary& summary, const FlightReportMaterial& material) {
  auto json = to_json(summary);
  json["version"] = material.program_version;
  auto series = JsonValue::object();
  const auto add = [&](const char* key, Getter get) {
    series[key] = JsonValue::array_of(series_of(summary, key, get).y);
  };
  series["time_s"] = JsonValue::array_of(series_of(summary, "time_s", truth_of<0>).x);
  add("goal_x_m", goal_of<0>), add("goal_y_m", goal_of<1>), add("goal_z_m", goal_of<2>);
  add("estimated_x_m", estimate_of<0>), add("estimated_y_m", estimate_of<1>),
      add("estimated_z_m", estimate_of<2>);
  add("true_x_m", truth_of<0>), add("true_y_m", truth_of<1>), add("true_z_m", truth_of<2>);
  add("true_yaw_deg", true_yaw_of), add("tilt_deg", tilt_of);
  json["series"] = std::move(series);
  return json;
}

}  // namespace hm
