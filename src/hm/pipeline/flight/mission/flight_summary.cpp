#include "hm/pipeline/flight/mission/flight_summary.hpp"

#include <algorithm>

#include "hm/core/angle.hpp"
#include "hm/core/text/counted.hpp"
#include "hm/flight/flight_text.hpp"
#include "hm/report/run_report.hpp"

namespace hm {
namespace {

void add_hover(const HoverError& hover, SummaryTree& v) {
  v({"max_xy_m", "hovering, in the plane at most", "{:.3f} m"}, hover.max_xy_m);
  v({"max_z_m", "hovering, in height at most", "{:.3f} m"}, hover.max_z_m);
  v({"rms_m", "hovering, RMS", "{:.3f} m"}, hover.rms_m);
  v({"duration_s", "hovered for", "{:.1f} s"}, hover.duration_s);
}

void add_way_points(const std::vector<WayPointRecord>& all, SummaryTree& v) {
  const auto reached = std::ranges::count_if(all, &WayPointRecord::reached);
  v({"reached", "way points reached"}, static_cast<std::int64_t>(reached));
  v({"missed", "way points missed"}, static_cast<std::int64_t>(all.size()) - reached);
  double worst_m = 0;
  for (const WayPointRecord& way_point : all)
    if (way_point.reached) worst_m = std::max(worst_m, way_point.nearest_m);
  v({"worst_m", "true distance from those reached, at most", "{:.3f} m"},
    reached > 0 ? std::optional(worst_m) : std::nullopt);
}

void add_order(const OrderRecord& record, Time start, SummaryTree& v) {
  v({"order", "order"}, record.order.text);
  v({"outcome", "outcome"}, to_string(record.outcome));
  const bool begun = record.outcome != OrderOutcome::kSkipped;
  const auto seconds = [&](Time stamp) {
    return begun ? std::optional((stamp - start).seconds()) : std::nullopt;
  };
  v({"begin_s", "from", "{:.2f} s"}, seconds(record.begin));
  v({"end_s", "to", "{:.2f} s"}, seconds(record.end));
  v({"reason", "reason"},
    record.reason.empty() ? std::nullopt : std::optional<std::string_view>(record.reason));
}

void add_fail_safe(const FailSafeEpisode& episode, SummaryTree& v) {
  v({"name", "fail-safe"}, text_of(episode.which));
  v({"begin_s", "from", "{:.3f} s"}, episode.begin_s);
  v.or_null({"end_s", "to", "{:.3f} s"}, episode.end_s);
  v({"angle_deg", "angle", "{:.0f} deg", kDegreesPerRadian}, episode.angle_rad);
}

void add_latency(const StageLatency& stage, SummaryTree& v) {
  constexpr double kMs = 1e3;
  v({"stage", "stage"}, stage.stage);
  v({"count", "messages"}, stage.latency_s.count);
  v({"mean_s", "mean", "{:.1f} ms", kMs}, stage.latency_s.mean);
  v({"p99_s", "99 %", "{:.1f} ms", kMs}, stage.latency_s.p99);
  v({"max_s", "most", "{:.1f} ms", kMs}, stage.latency_s.max);
}

}  // namespace

ParamList list_flight_mission(FlightParameters& parameters) {
  ParamList list = list_flight(parameters.flight);
  list.add("pilot", parameters.pilot);
  list.add("ground_station", parameters.ground_station);
  list.add_missing(list_laser(parameters.perception));
  return list;
}

Result<void> check_parameters(const FlightParameters& parameters) {
  return check_parameters(parameters.perception);
}

std::string mishap_of(const FlightSummary& summary) {
  if (summary.core_failure) return "the autopilot failed: " + *summary.core_failure;
  if (summary.collisions > 0) return counted(summary.collisions, "collision") + " with the surroundings";
  if (summary.end_state == "flying") return "the flight ended in the air";
  if (summary.end_state == "fallen") return "the vehicle does not stand on its feet in the end";
  return "";
}

Trajectory truth_in_odom(const FlightSummary& summary) {
  Trajectory path = summary.truth;
  const SE3 T_odom_world = summary.T_world_odom.inverse();
  for (StampedPose& pose : path) pose.T_world_base = T_odom_world * pose.T_world_base;
  return path;
}

void visit(const FlightSummary& summary, SummaryTree& v) {
  const FlightLog& log = summary.log;
  v({"mission"}, summary.mission);
  v({"collisions", "collisions"}, summary.collisions);
  if (const auto hover = log.hover())
    v.object("hover", [&](SummaryTree& below) { add_hover(*hover, below); });
  else
    v.json("hover", {});
  v.object("waypoints", [&](SummaryTree& below) { add_way_points(log.way_points(), below); });
  const auto& fail_safes = log.fail_safes();
  v.list_of("failsafes", fail_safes.size(),
            [&](std::size_t i, SummaryTree& row) { add_fail_safe(fail_safes[i], row); });
  v({"realtime_ratio", "times real time", "{:.1f}"}, summary.flight_s / std::max(summary.run_s, 1e-9));
  v({"end_state", "in the end"}, summary.end_state);
  v({"interrupted"}, summary.interrupted);
  v({"flight_s", "simulated", "{:.1f} s"}, summary.flight_s);
  v({"run_s", "took", "{:.1f} s"}, summary.run_s);
  v({"air_s", "in the air", "{:.1f} s"}, log.air_s());
  v({"path_length_m", "path", "{:.1f} m"}, log.path_m());
  v({"max_speed_m_s", "greatest speed", "{:.2f} m/s"}, log.max_speed_m_s());
  v({"max_tilt_rad", "greatest tilt", "{:.1f} deg", kDegreesPerRadian}, log.max_tilt_rad());
  v.spread({"estimate_error_m", "error of the estimate", "{:.3f} m"}, log.estimate_error_m(),
           {"rmse", "p95", "max"});
  v({"scans", "scans"}, summary.scans);
  v({"refused", "commands refused"}, log.refusals());
  v.group("mvog", summary.map);
  v.list_of("orders", summary.orders.size(),
            [&](std::size_t i, SummaryTree& row) { add_order(summary.orders[i], summary.start, row); });
  v.list_of("events", log.events().size(), [&](std::size_t i, SummaryTree& row) {
    row({"time_s", "time", "{:.3f} s"}, log.events()[i].time_s);
    row({"text", "event"}, log.events()[i].text);
  });
  v.list_of("latencies", summary.latencies.size(),
            [&](std::size_t i, SummaryTree& row) { add_latency(summary.latencies[i], row); });
  v.list_of("stages", summary.counts.size(), [&](std::size_t i, SummaryTree& row) {
    const StageCounts& stage = summary.counts[i];
    row({"stage", "stage"}, stage.stage);
    row({"in", "in"}, stage.in);
    row({"out", "out"}, stage.out);
    row({"dropped", "dropped"}, stage.dropped);
  });
}

std::string to_text(const FlightSummary& summary) {
  const SummaryTree tree = describe(summary);
  std::string text = tree.lines(
      {"{mission}: {air_s} in the air, path {path_length_m}, at most {max_speed_m_s}; {end_state}, "
       "{collisions|collision}",
       "hover      in the plane at most {hover.max_xy_m}, in height {hover.max_z_m}, RMS {hover.rms_m} over "
       "{hover.duration_s}, against the truth"});
  if (!summary.log.way_points().empty())
    text +=
        tree.lines({"waypoints  {waypoints.reached} reached[, at most {waypoints.worst_m} off], "
                    "{waypoints.missed} missed"});
  text += tree.lines({"estimate   off by {estimate_error_m.rmse} (RMS), {estimate_error_m.max} at most",
                      "map        {mvog.area_m2}, {mvog.bytes}",
                      "time       {flight_s} simulated in {run_s}: {realtime_ratio} times real time"});
  for (const OrderRecord& record : summary.orders)
    if (record.outcome == OrderOutcome::kMissed)
      text += fmt::format("missed     '{}': {}\n", record.order.text, record.reason);
  for (const FailSafeEpisode& episode : summary.log.fail_safes())
    text += fmt::format("fail-safe  {} at {:.2f} s\n", text_of(episode.which), episode.begin_s);
  return text + output_lines(summary.outputs);
}

}  // namespace hm
