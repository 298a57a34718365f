#include "hm/pipeline/experiments/laser/laser_map_experiments.hpp"

#include <algorithm>
#include <cmath>

#include "hm/core/angle.hpp"
#include "hm/io/bytes/file_bytes.hpp"
#include "hm/pipeline/laser/run/laser_run.hpp"
#include "hm/pipeline/simulate/laser_simulation_recording.hpp"
#include "hm/report/map_figures.hpp"
#include "hm/report/path_plots.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;

constexpr const char* kLaserRunFolder = "run";

/// A run through the laser system, in a folder of the experiment.
struct LaserMapRun {
  LaserSummary summary;
  fs::path recording;
  std::string words;  ///< what was run, and where its report is
  bool simulated = false;
};

/// Runs a recording below the folder of data, or a simulated flight where it is absent (or none is named).
Result<LaserMapRun> map_recording(const char* name, const char* relations, const ExperimentOptions& options,
                                  ExperimentFindings& findings) {
  LaserMapRun result;
  LaserRunOptions run;
  std::error_code code;
  if (name != nullptr && !options.data.empty() && fs::exists(options.data / "laser" / name, code)) {
    run.recording = options.data / "laser" / name;
    if (relations != nullptr) run.relations = options.data / "laser" / relations;
    result.words = fmt::format("recording {}", name);
    if (options.tiny) run.parameters.laser.run.duration_s = 20;
  } else {
    if (name != nullptr)
      findings.warnings.push_back(
          fmt::format("the recording laser/{} is absent: a simulated flight instead", name));
    LaserSimulationOptions flight;
    flight.params.seed = options.parameters.simulation.seed;
    flight.params.scan_limit = options.tiny ? 600 : 0;
    flight.output = options.output / "flight";
    flight.run = options.run;
    if (const auto made = simulate_laser_recording(flight); !made) return forward_error(made);
    run.recording = flight.output;
    result.words = "simulated flight through the house";
    result.simulated = true;
  }
  result.recording = run.recording;
  run.output = options.output / kLaserRunFolder;
  run.existing = ExistingResult::kOverwrite;  // the folder has been opened for the whole experiment
  run.run = options.run;
  auto summary = run_laser(run);
  if (!summary) return forward_error(summary);
  if (summary->interrupted) return fail(ErrorCode::kCancelled, {}, "stopped in a run of an experiment");
  for (const std::string& warning : summary->warnings) findings.warnings.push_back("run: " + warning);
  findings.outputs.push_back(run.output);
  result.words += fmt::format("; the whole run: {}/report.html", kLaserRunFolder);
  result.summary = std::move(*summary);
  return result;
}

void add_run_rows(const LaserSummary& summary, std::vector<ExperimentRow>& rows) {
  constexpr double kCmPerM = 100, kPublishedRate_hz = 30;
  const double scans = static_cast<double>(std::max<std::size_t>(1, summary.scans_read));
  rows.push_back(
      {"scans with a pose", {}, 100 * static_cast<double>(summary.trajectory.size()) / scans, "%"});
  rows.push_back({"length of the path", {}, path_length(summary.trajectory), "m"});
  rows.push_back({"rate that matching a scan allows", kPublishedRate_hz,
                  1e3 / std::max(1e-6, summary.match_ms.mean), "Hz"});
  rows.push_back({"area of the map", {}, summary.mvog.area_m2, "m2"});
  if (summary.error)
    rows.push_back({"position error, RMS", {}, kCmPerM * summary.error->position_m.rmse, "cm"});
  if (summary.error_odom)
    rows.push_back({"position error before loops are closed, RMS",
                    {},
                    kCmPerM * summary.error_odom->position_m.rmse,
                    "cm"});
  if (summary.height_error)
    rows.push_back({"error of the height, RMS", {}, kCmPerM * summary.height_error->rmse_m, "cm"});
  if (summary.relation_error) {
    rows.push_back(
        {"error over known relations, mean", {}, kCmPerM * summary.relation_error->translation_m.mean, "cm"});
    rows.push_back({"turn over known relations off by, mean",
                    {},
                    kDegreesPerRadian * summary.relation_error->rotation_rad.mean,
                    "deg"});
  }
}

/// Adds the pictures that a run wrote of its map.
void add_run_pictures(HtmlReport& report, const fs::path& folder) {
  for (const auto& [file, words] :
       {std::pair{"plan.png", "Plan: occupied dark, free light, unknown grey; the path."},
        std::pair{"above.png", "The highest occupied cells from above, coloured by height."},
        std::pair{"perspective.png", "The occupied cells, with the path."}})
    if (const auto bytes = read_file_bytes(folder / "pictures" / file))
      report.add_figure(*bytes, words, words);
}

/// All returns of the horizontal beams, in the map.
Result<std::vector<Vec2>> map_points(const LaserMapRun& run) {
  constexpr double kGap_s = 0.5;
  const auto recording = open_laser_recording(run.recording);
  if (!recording) return forward_error(recording);
  const LaserStream& laser = recording->lasers.front();
  std::vector<Vec2> points;
  for (const LaserScan& scan : laser.scans) {
    const auto pose = pose_at(run.summary.trajectory, scan.stamp, Duration::from_seconds(kGap_s));
    if (!pose) continue;
    const SE3 T_map_laser = *pose * laser.T_base_laser;
    for (std::size_t beam = 0; beam < scan.size(); ++beam) {
      if (!scan.is_return(beam)) continue;
      const double angle = scan.angle_rad(beam), range = static_cast<double>(scan.ranges_m[beam]);
      const Vec3 p = T_map_laser * Vec3(range * std::cos(angle), range * std::sin(angle), 0);
      points.emplace_back(p.x(), p.y());
    }
  }
  return points;
}

/// Points from above, darker where there are more, and the path.
Figure draw_points(const std::vector<Vec2>& points, const Trajectory& path, int width_px) {
  Eigen::AlignedBox2d box;
  for (const Vec2& p : points) box.extend(p);
  const Vec2 size = box.sizes().cwiseMax(0.1);
  const bool turned = size.y() > size.x();  // the longer side lies along the width
  const double px_m = width_px / (turned ? size.y() : size.x());
  const int height_px = std::max(1, static_cast<int>(std::ceil(px_m * (turned ? size.x() : size.y())))) + 1;
  Image<Rgb8> image(width_px + 1, height_px, Rgb8{255, 255, 255});
  const auto pixel = [&](const Vec2& p) -> Rgb8* {
    const Vec2 q = px_m * (p - box.min());
    const int x = static_cast<int>(turned ? q.y() : q.x()),
              y = height_px - 1 - static_cast<int>(turned ? size.x() * px_m - q.x() : q.y());
    return image.contains(x, y) ? &image(x, y) : nullptr;
  };
  for (const Vec2& p : points)
    if (Rgb8* at = pixel(p)) {
      const auto darker = static_cast<std::uint8_t>(at->r - at->r / 4);
      *at = {darker, darker, darker};
    }
  for (const StampedPose& pose : path)
    if (Rgb8* at = pixel(pose.T_world_base.translation().head<2>())) *at = {214, 84, 32};
  Figure figure{"points", "All returns from above, darker where there are more; the path in red.",
                std::move(image)};
  set_scale(figure, width_px / px_m);
  return figure;
}

}  // namespace

Result<ExperimentFindings> run_corridor_experiment(const ExperimentOptions& options) {
  ExperimentFindings findings;
  const auto run = map_recording("wean_robotdata1.log", nullptr, options, findings);
  if (!run) return forward_error(run);
  add_run_rows(run->summary, findings.rows);
  const auto points = map_points(*run);
  if (!points) return forward_error(points);
  findings.rows.push_back({"points", {}, static_cast<double>(points->size()), ""});
  findings.add_figures = [figure = draw_points(*points, run->summary.trajectory, 1400),
                          words = run->words](HtmlReport& report) {
    report.begin_section("Points of all scans", words);
    add_figure(report, figure);
  };
  return findings;
}

Result<ExperimentFindings> run_floor_map_experiment(const ExperimentOptions& options) {
  ExperimentFindings findings;
  const auto run = map_recording("flirt_fr079.log", "fr079.relations", options, findings);
  if (!run) return forward_error(run);
  add_run_rows(run->summary, findings.rows);
  findings.add_figures = [folder = options.output / kLaserRunFolder, words = run->words](HtmlReport& report) {
    report.begin_section("Plan of the floor", words);
    add_run_pictures(report, folder);
  };
  return findings;
}

Result<ExperimentFindings> run_flight_map_experiment(const ExperimentOptions& options) {
  ExperimentFindings findings;
  auto run = map_recording(nullptr, nullptr, options, findings);
  if (!run) return forward_error(run);
  add_run_rows(run->summary, findings.rows);
  std::error_code code;  // only large
  fs::remove_all(run->recording, code);
  findings.add_figures = [folder = options.output / kLaserRunFolder,
                          shown = std::make_shared<const LaserMapRun>(std::move(*run))](HtmlReport& report) {
    report.begin_section("Map", shown->words);
    add_run_pictures(report, folder);
    if (!shown->summary.error) return;
    report.begin_section("Path", "Fig. 2.14: estimated and true path.");
    const Trajectory truth = matched_truth(*shown->summary.error),
                     estimate = matched_estimate(*shown->summary.error);
    const NamedTrajectory paths[] = {{"truth", &truth}, {"estimate", &estimate}};
    add_path_views(report, paths, "Aligned to the true path.");
  };
  return findings;
}

}  // namespace hm
