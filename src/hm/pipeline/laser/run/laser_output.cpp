#include "hm/pipeline/laser/run/laser_output.hpp"

#include <algorithm>
#include <limits>

#include "hm/core/text/counted.hpp"
#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/bytes/json.hpp"
#include "hm/io/pose/trajectory_file.hpp"
#include "hm/pipeline/common/map_export.hpp"
#include "hm/pipeline/laser/laser_map_frame.hpp"
#include "hm/pipeline/laser/run/laser_evaluation.hpp"
#include "hm/pipeline/laser/run/laser_run_report.hpp"
#include "hm/pipeline/laser/run/laser_summary.hpp"
#include "hm/pipeline/laser/run/laser_tables.hpp"
#include "hm/report/map_figures.hpp"
#include "hm/report/render/mesh_renderer.hpp"

namespace hm {
namespace {

/// Of the pose graph, half a metre or half a radian apart: so short a path need not come back.
constexpr std::size_t kFewNodes = 40;
constexpr Rgb8 kEstimateColor{214, 84, 32}, kTruthColor{36, 110, 200};

void say(const LaserRunOptions& options, const char* stage) {
  if (options.run.progress) options.run.progress({stage, 0, 0, {}});
}

void add_warnings(LaserSummary& summary) {
  if (summary.scans_failed > 0) {
    const auto most = std::max_element(summary.failure_reasons.begin(), summary.failure_reasons.end(),
                                       [](const auto& a, const auto& b) { return a.second < b.second; });
    summary.warnings.push_back(fmt::format(
        "{} of {} without a pose; the most frequent reason ({}): {}", with_thousands(summary.scans_failed),
        counted(summary.scans_read, "scan"), counted(most->second, "time"), most->first));
  }
  if (summary.restarts > 0)
    summary.warnings.push_back(
        fmt::format("scan matching was lost and restarted {}{}", counted(summary.restarts, "time"),
                    summary.map_frame.corrected
                        ? ": path and map are broken there unless a closed loop or the saved map joins them"
                        : ": path and map are broken there"));
  if (const auto& place = summary.map_frame.localisation; place && !place->is_sure())
    summary.warnings.push_back(fmt::format(
        "the place in the map is doubtful: {} of {} located, lost {}, median score {:.2f} (reliable: {:g} or "
        "more)",
        with_thousands(place->located), counted(place->scans, "scan"), counted(place->lost, "time"),
        place->score.median, LocalisationSummary::kSureScore));
  if (const MapFrameSummary& map = summary.map_frame;
      map.source == MapFrameSource::kLoops && map.nodes > kFewNodes && map.loops.accepted == 0)
    summary.warnings.emplace_back(
        "no place was recognised again, so no loop was closed: what the path errs by has added up on its "
        "way");
  if (summary.scans_dropped > 0)
    summary.warnings.push_back(fmt::format("{} of {} dropped: they came faster than they could be processed",
                                           with_thousands(summary.scans_dropped),
                                           counted(summary.scans_total, "scan")));
  if (summary.interrupted)
    summary.warnings.push_back(fmt::format("stopped after {} of {}", with_thousands(summary.scans_read),
                                           counted(summary.scans_total, "scan")));
}

Trajectory truth_in_map_of(const LaserSummary& summary) {
  Trajectory truth_in_map;  // the truth, moved to where the estimate is
  const SimilarityTransform& move = summary.error->alignment;
  for (const PosePair& pair : summary.error->matched)
    truth_in_map.push_back(
        {pair.stamp, SE3(pair.T_world_truth.rotation(),
                         move.rotation.transpose() * (pair.T_world_truth.translation() - move.translation) /
                             move.scale)});
  return truth_in_map;
}

/// A vehicle that flies over floors is within a building: its ceiling hides the rooms.
constexpr double kCutOverPath_m = 0.4;

double highest_m(const Trajectory& trajectory) {
  double highest = -std::numeric_limits<double>::infinity();
  for (const StampedPose& pose : trajectory) highest = std::max(highest, pose.T_world_base.translation().z());
  return highest;
}

struct MapDrawing {
  const OccupancyGrid2D& slice;
  const std::optional<OccupancyGrid2D>& slice_odom;
  const std::vector<OccupancyVoxel>& voxels;
  const TriangleMesh& faces;
};

std::vector<Figure> draw_figures(const MapDrawing& map, const LaserSummary& summary,
                                 const ParallelLoop& loop) {
  std::vector<Figure> figures;
  const double size_m = summary.parameters.laser.mvog.resolution_m;
  const Trajectory truth = summary.error ? truth_in_map_of(summary) : Trajectory{};
  std::vector<MapOverlay> paths;
  if (!truth.empty()) paths.push_back({"truth", &truth, kTruthColor});
  paths.push_back({"estimate", &summary.trajectory, kEstimateColor});
  if (auto plan = draw_occupancy_grid(map.slice, paths))
    figures.push_back({"plan",
                       summary.planar
                           ? "The map from above: occupied dark, free light, unknown grey."
                           : fmt::format("The map from above between heights of {:g} m and {:g} m: "
                                         "occupied dark, free light, unknown grey.",
                                         summary.parameters.laser.run.slice_bottom_m,
                                         summary.parameters.laser.run.slice_top_m),
                       std::move(*plan), HtmlReport::Place::kWide, legend_of(paths)});
  if (!figures.empty()) set_scale(figures.back(), map.slice.cells.width() * map.slice.resolution_m);
  if (map.slice_odom) {
    const std::vector<MapOverlay> path{{"odometry", &summary.trajectory_odom, kEstimateColor}};
    if (auto before = draw_occupancy_grid(*map.slice_odom, path)) {
      figures.insert(figures.begin(), {"plan_odom", "Before: the map of odometry's own poses.",
                                       std::move(*before), HtmlReport::Place::kHalf, legend_of(path)});
      set_scale(figures.front(), map.slice_odom->cells.width() * map.slice_odom->resolution_m);
      if (figures.size() > 1) {
        figures.back().place = HtmlReport::Place::kHalf;
        figures.back().caption = "After the correction: " + figures.back().caption;
      }
    }
  }
  if (summary.planar || map.faces.triangles.empty()) return figures;
  if (auto above = draw_heights(map.voxels, size_m))
    figures.push_back(
        {"above", "The highest occupied cells from above, coloured by height.", std::move(*above)});
  RenderOptions render;
  render.width = 1400, render.height = 900;
  render.style = RenderStyle::kHeight;
  render.trajectory = &summary.trajectory;
  RenderView view = dollhouse_view(scene_extent(map.faces), render);
  if (!summary.floors.empty()) view.cut_height_m = highest_m(summary.trajectory) + kCutOverPath_m;
  figures.push_back({"perspective",
                     "The map's occupied cells, by height, with the path; in a building, what lies well "
                     "above the path is cut away.",
                     render_mesh(map.faces, view, render, loop)});
  return figures;
}

Result<void> write_map(const LaserMaps& maps, const LaserRunOptions& options, LaserReportMaterial& material,
                       LaserSummary& summary) {
  MeshWriteOptions write;
  write.frame = summary.map_frame.corrected ? "map" : "odom",
  write.program = "housemartin " + options.run.program_version;
  ResultFiles files(options.output, summary.outputs, summary.warnings);
  const auto slice = laser_slice(maps.map, options.parameters.laser.run);
  const auto layers = write_map_files(maps.map, slice, write, files);
  if (!layers) return forward_error(layers);
  if (!options.parameters.laser.run.pictures || !slice) return {};
  say(options, "drawing figures");
  std::optional<OccupancyGrid2D> slice_odom;
  if (maps.map_odom)
    if (auto odom = laser_slice(*maps.map_odom, options.parameters.laser.run)) slice_odom = std::move(*odom);
  const ParallelLoop loop(options.run.threads);
  material.figures = draw_figures({*slice, slice_odom, layers->voxels, layers->faces}, summary, loop);
  return write_figures(options.output, material.figures, summary.outputs, loop);
}

Result<void> write_texts(const LaserRunOptions& options, const LaserReportMaterial& material,
                         LaserSummary& summary) {
  ResultFiles writer(options.output, summary.outputs, summary.warnings);
  writer.file("trajectory.tum",
              [&](const auto& path) { return write_tum_trajectory(path, summary.trajectory); });
  if (summary.map_frame.source != MapFrameSource::kOdometry)
    writer
        .file("trajectory_odom.tum",
              [&](const auto& path) { return write_tum_trajectory(path, summary.trajectory_odom); })
        .text("map_frame.csv", map_frame_csv(summary.map_frame));
  std::error_code code;
  if (std::filesystem::exists(options.output / kHeightTable, code))
    writer.written(kHeightTable).text("floors.csv", floors_csv(summary.floors));
  if (std::filesystem::exists(options.output / kStateTable, code)) writer.written(kStateTable);
  writer.text("parameters.toml", material.parameters_toml);
  if (!writer.result()) return writer.result();
  for (const char* name : {"report.json", "report.html"}) summary.outputs.push_back(options.output / name);
  const std::string json = to_json_text(laser_report_json(summary, options.run.program_version));
  if (const auto written = write_file_text(options.output / "report.json", json + "\n"); !written)
    return written;
  return write_file_text(options.output / "report.html", laser_report_html(summary, material));
}

}  // namespace

Result<void> write_laser_results(const LaserMaps& maps, const LaserRecording& recording,
                                 const LaserRunOptions& options, LaserSummary& summary) {
  say(options, "writing results");
  evaluate_laser_run(recording, options, summary);
  add_warnings(summary);
  LaserReportMaterial material;
  material.program_version = options.run.program_version;
  material.parameters_toml = list_laser(summary.parameters).to_toml();
  if (const auto written = write_map(maps, options, material, summary); !written)
    return as_run_failure(written);
  return as_run_failure(write_texts(options, material, summary));
}

}  // namespace hm
