#include "hm/pipeline/flight/mission/flight_report.hpp"

#include "hm/core/angle.hpp"
#include "hm/pipeline/flight/mission/flight_plots.hpp"
#include "hm/report/run_report.hpp"

namespace hm {
namespace {

double tilt_deg(const FlightSample& sample) { return sample.tilt_rad * kDegreesPerRadian; }
double battery_percent(const FlightSample& sample) { return 100 * sample.battery_ratio; }
FlightQuantity estimated_speed(int axis) {
  return [axis](const FlightSample& sample) { return sample.estimate.velocity_m_s(axis); };
}
FlightQuantity true_speed(int axis) {
  return [axis](const FlightSample& sample) { return sample.truth.velocity_m_s(axis); };
}
FlightQuantity error_cm(int axis) {
  constexpr double kCm = 100;
  return [axis](const FlightSample& sample) {
    return kCm * (sample.estimate.position_m(axis) - sample.truth.position_m(axis));
  };
}

void add_motion_section(HtmlReport& report, const FlightSummary& summary) {
  const auto series = [&](const char* name, const FlightQuantity& quantity) {
    return flight_series(summary, name, quantity);
  };
  report.begin_section("Motion");
  add_flight_plot(report,
                  {series("x, estimated", estimated_speed(0)), series("x, true", true_speed(0)),
                   series("y, estimated", estimated_speed(1)), series("y, true", true_speed(1))},
                  "velocity (m/s)", "Velocity in the frame odom.");
  add_flight_plot(report, {series("x", error_cm(0)), series("y", error_cm(1)), series("z", error_cm(2))},
                  "error (cm)", "Estimated minus true position.");
  add_flight_plot(report, {series("tilt", tilt_deg)}, "tilt (deg)", "True tilt.");
  add_flight_plot(report, {series("charge", battery_percent)}, "charge (%)",
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
  report.begin_section("Position",
                       "Commanded, estimated on board and true, in the frame odom of the start. A goal is "
                       "drawn while the vehicle goes to or keeps a position.");
  add_position_plots(report, summary);
  report.begin_section("Path");
  add_path_plot(report, summary);
  for (const Figure& figure : material.figures) add_figure(report, figure);
  if (!summary.heights.empty()) {
    report.begin_section("Height", "From the beams that the mirror turns to the floor.");
    add_height_plot(report, summary);
  }
  add_motion_section(report, summary);
  add_tables(report, tree);
  return page_with_parameters(report, material.parameters_toml, material.program_version);
}

JsonValue flight_report_json(const FlightSummary& summary, const FlightReportMaterial& material) {
  auto json = to_json(summary);
  json["version"] = material.program_version;
  auto series = JsonValue::object();
  const auto add = [&](const char* key, const FlightQuantity& quantity) {
    series[key] = JsonValue::array_of(flight_series(summary, key, quantity).y);
  };
  add("time_s", [](const FlightSample& sample) { return sample.time_s; });
  for (int axis = 0; axis < 3; ++axis) {
    const char letter = "xyz"[axis];
    add(fmt::format("goal_{}_m", letter).c_str(), commanded_position(axis));
    add(fmt::format("estimated_{}_m", letter).c_str(), estimated_position(axis));
    add(fmt::format("true_{}_m", letter).c_str(), true_position(axis));
  }
  add("true_yaw_deg", true_yaw_deg()), add("tilt_deg", tilt_deg);
  json["series"] = std::move(series);
  return json;
}

}  // namespace hm
