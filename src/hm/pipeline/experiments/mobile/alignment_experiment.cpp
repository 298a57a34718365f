#include "hm/pipeline/experiments/mobile/alignment_experiment.hpp"

#include <array>
#include <memory>

#include "hm/core/angle.hpp"
#include "hm/evaluation/trajectory_error.hpp"
#include "hm/mapping/dense_pipeline.hpp"
#include "hm/pipeline/experiments/mobile/integration_run.hpp"
#include "hm/report/path_plots.hpp"

namespace hm {
namespace {

/// A map of the walk with its poses, and how far both are from the truth.
struct AlignedMap {
  const char* name;
  Trajectory poses = {};
  std::vector<double> align_ms = {};
  std::size_t accepted = 0;
  TriangleMesh mesh = {};
  TrajectoryError path_error = {};
  MeshError surface_error = {};
};

Result<void> build_map(const ExperimentFrames& frames, bool align, const ExperimentOptions& options,
                       AlignedMap& map) {
  DenseParams params;
  params.tsdf.voxel_size_m = options.tiny ? 0.05 : 0.03;
  params.depth_noise = frames.simulation->sensor().noise;
  params.reconstruction.align = align;
  params.reconstruction.live_mesh = false;
  DensePipeline pipeline(params, frames.source->camera(), options.run.threads);
  auto done = for_each_frame(frames, options.run, [&](const RgbdFrame& frame) -> Result<void> {
    const FrameOutcome outcome = pipeline.process(frame);
    if (!outcome.integrated) return {};
    map.poses.push_back({frame.stamp, outcome.T_world_camera});
    if (!outcome.alignment) return {};
    map.align_ms.push_back(outcome.alignment->milliseconds);
    map.accepted += outcome.alignment->status == AlignmentStatus::kAccepted ? 1U : 0U;
    return {};
  });
  if (!done) return done;
  map.mesh = pipeline.take_finished_mesh();
  return {};
}

Result<void> judge_map(const Trajectory& truth, const TrueSurface& surface, const ExperimentOptions& options,
                       AlignedMap& map) {
  TrajectoryErrorParams as_given;
  as_given.alignment = TrajectoryAlignment::kNone;  // both start at the true pose
  auto path = evaluate_trajectory(truth, map.poses, as_given);
  if (!path) return forward_error(path);
  map.path_error = std::move(*path);
  MeshErrorParams params;
  params.samples = options.tiny ? 20'000 : 300'000;
  auto error =
      evaluate_mesh(map.mesh, surface.mesh, params, ParallelLoop(options.run.threads), surface.visible);
  if (!error) return forward_error(error);
  map.surface_error = std::move(*error);
  return {};
}

void add_map_rows(const AlignedMap& map, std::vector<ExperimentRow>& rows) {
  constexpr double kCm = 100, kMm = 1e3;
  const std::string name = map.name;
  rows.push_back({name + ": position error, RMS", {}, kCm * map.path_error.position_m.rmse, "cm"});
  rows.push_back(
      {name + ": position error at the end", {}, kCm * map.path_error.position_errors_m.back(), "cm"});
  rows.push_back({name + ": distance of the mesh from the true surface, mean",
                  {},
                  kMm * map.surface_error.accuracy.distance_m.mean,
                  "mm"});
  rows.push_back({name + ": true surface reconstructed within 2 cm",
                  {},
                  100 * map.surface_error.completeness.ratio,
                  "%"});
}

}  // namespace

Result<ExperimentFindings> run_alignment_experiment(const ExperimentOptions& options) {
  SimulationParams scene = options.parameters.simulation;
  scene.world = options.tiny ? WorldKind::kRoom : WorldKind::kHouse;
  scene.sensor = SensorPreset::kTangoTablet;
  scene.pose_drift = true;
  const ExperimentFrames frames = simulated_frames(scene, options.tiny ? 20 : 600, options.run.threads);
  const ParallelLoop loop(options.run.threads);
  Trajectory truth;
  for (std::size_t i = 0; i < frames.count; ++i)
    truth.push_back({frames.simulation->stamp(i), frames.simulation->true_pose(i)});
  const TrueSurface surface = true_surface(*frames.simulation, loop);
  const auto maps = std::make_shared<std::array<AlignedMap, 2>>(
      std::array<AlignedMap, 2>{AlignedMap{"poses as given"}, AlignedMap{"dense alignment"}});
  ExperimentFindings findings;
  for (AlignedMap& map : *maps) {
    if (auto built = build_map(frames, &map == &maps->back(), options, map); !built)
      return forward_error(built);
    if (auto judged = judge_map(truth, surface, options, map); !judged) return forward_error(judged);
    add_map_rows(map, findings.rows);
  }
  const AlignedMap& aligned = maps->back();
  findings.rows.push_back({"scans aligned",
                           {},
                           100 * static_cast<double>(aligned.accepted) /
                               static_cast<double>(std::max<std::size_t>(1, aligned.align_ms.size())),
                           "%"});
  findings.rows.push_back({"time of aligning a scan, mean", {}, summarise(aligned.align_ms).mean, "ms"});
  findings.rows.push_back({"length of the walk", {}, path_length(truth), "m"});
  const CaptionedMesh meshes[] = {{"given", "Poses as given.", &(*maps)[0].mesh},
                                  {"aligned", "Dense alignment.", &(*maps)[1].mesh}};
  const auto figures = draw_side_by_side(meshes, RenderStyle::kShaded, options.tiny ? 120 : 900, loop);
  findings.add_figures = [maps, truth, figures, words = frames.words](HtmlReport& report) {
    report.begin_section("Paths", words + ", with the drift of visual-inertial odometry.");
    const NamedTrajectory paths[] = {
        {"truth", &truth}, {"as given", &(*maps)[0].poses}, {"aligned", &(*maps)[1].poses}};
    add_path_views(report, paths, "Not aligned afterwards: all begin at the same pose.");
    report.begin_section("Maps", "From the same frames.");
    for (const Figure& figure : figures) add_figure(report, figure);
  };
  return findings;
}

}  // namespace hm
