// Rows about the whole RGB-D system: a walk through the simulated house, from pictures alone.
#include "hm/evaluation/mesh_error.hpp"
#include "hm/mapping/dense_pipeline.hpp"
#include "hm/pipeline/common/truth_comparison.hpp"
#include "hm/pipeline/rgbd/slam_pipeline.hpp"
#include "hm/pipeline/rgbd/slam_state.hpp"
#include "measurement.hpp"
#include "rgbd/simulated_recording.hpp"

namespace hm::bench {
namespace {

constexpr int kMapStride = 5;  // dense maps of every fifth frame: both of them, so that they can be compared

RgbdParameters house_parameters(const BenchOptions& options) {
  RgbdParameters parameters;
  parameters.tsdf.voxel_size_m = 0.02;
  parameters.reconstruction.live_mesh = false;
  parameters.reconstruction.frame_limit = options.frame_limit;
  parameters.slam.map_stride = kMapStride;
  parameters.slam.rebuild_online = false;  // the same result, and each frame is rendered once less
  return parameters;
}

TriangleMesh moved(TriangleMesh mesh, const SimilarityTransform& move) {
  for (auto& vertex : mesh.vertices) vertex = (move * vertex.cast<double>()).cast<float>();
  return mesh;
}

/// Mean distance from the true surface, metres.
Result<double> surface_error_m(const TriangleMesh& mesh, const TriangleMesh& truth,
                               const ParallelLoop& loop) {
  MeshErrorParams params;
  params.samples = 300'000;
  const auto surface = SurfaceDistance::build(truth);
  if (!surface) return forward_error(surface);
  const auto accuracy = mesh_accuracy(mesh, *surface, params, loop);
  if (!accuracy) return forward_error(accuracy);
  return accuracy->distance_m.mean;
}

/// The map that the true poses give of the same frames.
TriangleMesh mesh_of_true_poses(const SimulatedRecording& recording, const Trajectory& used,
                                const RgbdParameters& parameters, int threads) {
  DensePipeline dense(parameters, recording.info().camera, threads);
  const std::size_t frames = recording.info().frame_count;
  std::size_t tracked = 0;
  for (std::size_t i = 0; i < frames && tracked < used.size(); ++i) {
    if (recording.info().stamps[i] != used[tracked].stamp) continue;
    if (tracked++ % kMapStride != 0) continue;
    auto frame = recording.read(i);
    frame->T_world_camera = recording.info().frame_poses[i];
    dense.process(*frame);
  }
  return dense.take_finished_mesh();
}

JsonValue details_of(const SlamPipeline::State& state) {
  return JsonValue::object({{"frames", state.frames_total},
                            {"tracked", state.track.frames_tracked},
                            {"lost", state.track.frames_lost},
                            {"submaps", state.track.submaps},
                            {"frames_disconnected", state.frames_disconnected},
                            {"keyframes", state.track.keyframes.size()},
                            {"track_ms_mean", state.track.track_ms.mean},
                            {"track_ms_p99", state.track.track_ms.p99},
                            {"loop_candidates", state.loops.candidates},
                            {"loops_accepted", state.loops.accepted},
                            {"map_stride", kMapStride},
                            {"volumes_rebuilt", state.correction.volumes_rebuilt},
                            {"tracking_s", state.seconds},
                            {"closing_s", state.close_seconds},
                            {"rebuilding_s", state.correction.seconds}});
}

}  // namespace

Result<BenchResult> bench_slam_house(const BenchOptions& options) {
  SimulationParams scene;
  scene.sensor = SensorPreset::kKinect;
  const SimulatedRecording recording(scene);
  const RgbdParameters parameters = house_parameters(options);
  RunContext run;
  run.threads = options.threads;
  SlamPipeline pipeline(recording, parameters, run);
  if (const auto tracked = pipeline.track_and_map(); !tracked) return forward_error(tracked);
  pipeline.close_loops();
  const TriangleMesh before = pipeline.mesh_of_odometry(/*keyframes_alone=*/false);
  if (const auto corrected = pipeline.correct_dense_map(); !corrected) return forward_error(corrected);
  const SlamPipeline::State& state = pipeline.state();

  std::vector<std::string> warnings;
  const auto odometry = compare_with_truth(state.track.trajectory, recording.info(), {}, warnings);
  const auto corrected = compare_with_truth(state.corrected, recording.info(), {}, warnings);
  if (!odometry || !corrected)
    return fail(ErrorCode::kInternal, "slam_house", "the trajectory cannot be judged");
  TrajectoryErrorParams unaligned;
  unaligned.alignment =
      TrajectoryAlignment::kNone;  // it begins at the true pose: what is left at the end is drift
  const auto drift = compare_with_truth(state.track.trajectory, recording.info(), unaligned, warnings);
  const double drift_ratio =
      drift ? drift->position_errors_m.back() / std::max(drift->truth_path_m, 1.0) : 1.0;

  const TriangleMesh truth = merged_mesh(recording.simulation().world());
  const ParallelLoop loop(options.threads);
  const auto of_odometry = surface_error_m(moved(before, odometry->alignment), truth, loop);
  const TriangleMesh mesh = pipeline.dense().take_finished_mesh();
  const auto of_slam = surface_error_m(moved(mesh, corrected->alignment), truth, loop);
  const auto of_truth = surface_error_m(
      mesh_of_true_poses(recording, state.track.trajectory, parameters, options.threads), truth, loop);
  if (!of_slam || !of_truth) return fail(ErrorCode::kInternal, "slam_house", "there is no mesh to judge");

  BenchResult result;
  result.rows = {{"slam_house", 100 * drift_ratio, {}},
                 {"slam_house_ate", 100 * corrected->position_m.rmse, 100 * odometry->position_m.rmse},
                 {"mesh_from_slam", *of_slam / *of_truth, {}}};
  result.details = details_of(state);
  result.details["path_m"] = odometry->truth_path_m;
  result.details["rpe_second_m"] = odometry->per_second.translation_m.rmse;
  result.details["mesh_true_poses_mm"] = *of_truth * 1e3;
  result.details["mesh_slam_mm"] = *of_slam * 1e3;
  result.details["mesh_odometry_mm"] = of_odometry ? JsonValue(*of_odometry * 1e3) : JsonValue();
  return result;
}

}  // namespace hm::bench
