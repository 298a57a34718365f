#include "hm/pipeline/flight/mission/flight_output.hpp"

#include <algorithm>

#include "hm/core/text/counted.hpp"
#include "hm/io/bytes/json.hpp"
#include "hm/io/laser/laser_rig_file.hpp"
#include "hm/io/pose/trajectory_file.hpp"
#include "hm/pipeline/common/map_export.hpp"
#include "hm/pipeline/flight/mission/flight_report.hpp"
#include "hm/pipeline/laser/laser_map_frame.hpp"
#include "hm/report/floor_plan_svg.hpp"
#include "hm/report/map_figures.hpp"

namespace hm {
namespace {

constexpr Rgb8 kEstimateColor{214, 84, 32}, kTruthColor{36, 110, 200};
constexpr double kShortestPlayback_s = 6, kLongestPlayback_s = 20, kPlaybackSpeed = 5;

void add_warnings(FlightSummary& summary) {
  const auto missed = std::ranges::count(summary.orders, OrderOutcome::kMissed, &OrderRecord::outcome);
  if (missed > 0) summary.warnings.push_back(fmt::format("{} missed", counted(missed, "order")));
  if (summary.end_state != "landed")
    summary.warnings.push_back(fmt::format("the vehicle has not landed in the end: {}", summary.end_state));
  if (summary.interrupted) summary.warnings.emplace_back("stopped: the vehicle landed where it was");
}

/// The flight over the world's floor plan, moving.
std::string flight_picture(const FlownMission& flown, const FlightSummary& summary) {
  const TriangleMesh mesh = merged_mesh(flown.site.world);
  PlanFlight flight;
  flight.path = &summary.truth;
  flight.playback_s = std::clamp(summary.flight_s / kPlaybackSpeed, kShortestPlayback_s, kLongestPlayback_s);
  for (const WayPointRecord& way_point : summary.log.way_points())
    flight.way_points.push_back(summary.T_world_odom * way_point.goal_m);
  return flight_plan_svg(mesh, scene_extent_along(mesh, Vec3::UnitZ()), flight);
}

Result<void> write_maps(const FlownMission& flown, FlightReportMaterial& material, FlightSummary& summary) {
  MeshWriteOptions write;
  write.frame = "odom";
  write.program = "housemartin " + flown.options.run.program_version;
  const LaserRunParams& params = flown.options.parameters.perception.laser.run;
  const MultiVolumeGrid& map = flown.run.perception().map();
  ResultFiles files(flown.folder, summary.outputs, summary.warnings);
  const auto layers = write_map_files(map, laser_slice(map, params), write, files);
  if (!layers) return forward_error(layers);
  if (!params.pictures || !layers->slice) return {};
  const Trajectory truth = truth_in_odom(summary);
  const std::vector<MapOverlay> paths{{"truth", &truth, kTruthColor},
                                      {"estimate", &summary.trajectory, kEstimateColor}};
  auto plan = draw_occupancy_grid(*layers->slice, paths);
  if (!plan) return {};
  material.figures.push_back(
      {"plan", "The laser's map from above, and the path: occupied dark, free light, unknown grey.",
       std::move(*plan), HtmlReport::Place::kWide, legend_of(paths)});
  set_scale(material.figures.back(), layers->slice->cells.width() * layers->slice->resolution_m);
  return write_figures(flown.folder, material.figures, summary.outputs, ParallelLoop(1));
}

}  // namespace

Result<void> write_flight_results(const FlownMission& flown, FlightSummary& summary) {
  const RunContext& run = flown.options.run;
  if (run.progress) run.progress({"writing results", 0, 0, {}});
  add_warnings(summary);
  FlightParameters parameters = summary.parameters;
  FlightReportMaterial material;
  material.program_version = run.program_version;
  material.parameters_toml = list_flight_mission(parameters).to_toml();
  material.flight_svg = flight_picture(flown, summary);
  ResultFiles files(flown.folder, summary.outputs, summary.warnings);
  files.written("recording.bag")
      .file("rig.toml", [&](const auto& path) { return write_laser_rig(path, flown.run.rig()); })
      .file("groundtruth.txt", [&](const auto& path) { return write_tum_trajectory(path, summary.truth); })
      .written("core.trace")
      .file("trajectory.tum",
            [&](const auto& path) { return write_tum_trajectory(path, summary.trajectory); });
  if (!files.result()) return as_run_failure(files.result());
  if (const auto maps = write_maps(flown, material, summary); !maps) return as_run_failure(maps);
  for (const char* name : {"flight.svg", "parameters.toml", "report.json", "report.html"})
    summary.outputs.push_back(flown.folder / name);
  std::vector<std::filesystem::path> named;
  const JsonValue json = flight_report_json(summary, material);
  ResultFiles texts(flown.folder, named, summary.warnings);
  texts.text("flight.svg", material.flight_svg)
      .text("parameters.toml", material.parameters_toml)
      .text("report.json", to_json_text(json) + "\n")
      .text("report.html", flight_report_html(summary, material));
  return as_run_failure(texts.result());
}

}  // namespace hm
