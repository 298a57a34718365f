#include "hm/pipeline/rgbd/slam_finish.hpp"

#include <cmath>
#include <utility>

#include "hm/core/text/counted.hpp"
#include "hm/pipeline/common/mesh_evaluation.hpp"
#include "hm/pipeline/common/truth_comparison.hpp"
#include "hm/pipeline/live/live_view.hpp"
#include "hm/pipeline/rgbd/odometry_run.hpp"
#include "hm/pipeline/rgbd/slam_output.hpp"
#include "hm/pipeline/rgbd/tracking_view.hpp"
#include "hm/pipeline/verdict/depth_visits.hpp"

namespace hm {
namespace {

Error nothing_tracked(const SlamRunOptions& options, const SlamPipeline::State& state,
                      const std::vector<std::string>& warnings) {
  if (state.interrupted) return {ErrorCode::kCancelled, "stopped before the first frame had a pose", {}};
  return {ErrorCode::kInvalidValue, why_no_pose(state.track, warnings), options.recording.string()};
}

/// An error where the run was to go on in a saved map that it has not recognised.
Result<void> check_recognised(const SlamRunOptions& options, const SlamPipeline::State& state) {
  if (!state.continued || state.continued->recognised_at_s) return {};
  const ContinuedMap& continued = *state.continued;
  const std::string best =
      continued.best.inliers == 0
          ? std::string("not one of its keyframes shares features with the map")
          : fmt::format(
                "at best {} agreed on a place, after {:.1f} s ({}), and two keyframes must agree, "
                "with {} each",
                counted(static_cast<std::size_t>(continued.best.inliers), "feature"), continued.best_at_s,
                to_string(continued.best.outcome), continued.inliers_needed);
  return fail(ErrorCode::kNoResult, options.continued.string(),
              "{}the map was not recognised in {} of {}: {}; nothing was written",
              state.interrupted ? "stopped too early: " : "",
              counted(state.track.keyframes.size(), "keyframe"), options.recording.string(), best);
}

void compare_trajectories(SlamSummary& summary) {
  const TrajectoryErrorParams& params = summary.parameters.trajectory_error;
  std::vector<std::string> said;  // of odometry; what counts is said of the corrected trajectory
  summary.odometry_error =
      compare_with_truth(summary.state.track.trajectory, summary.recording, params, said);
  summary.error = compare_with_truth(summary.state.corrected, summary.recording, params, summary.warnings);
}

std::string depth_warning(const DisparityOffset& disparity) {
  const auto off = [&](double at_m) { return 100 * disparity.offset_1_m * at_m; };
  return fmt::format(
      "depth is not right at all distances: as surfaces seen from different places say, 1/depth is 1/reading "
      "{:+.3f} 1/m (deviation {:.3f}), so that readings at 3 m are {:.0f} % too {}, compared with those at 1 "
      "m; calibrate depth (hm calibrate depth)",
      disparity.offset_1_m, disparity.sigma_1_m, std::abs(off(3) - off(1)),
      disparity.offset_1_m > 0 ? "long" : "short");
}

std::string focal_length_doubt(const FocalLengthCheck& focal, const PinholeCamera& camera) {
  return fmt::format(
      "the focal length is {:.0f} px, and surfaces seen from different sides agree better with {:.0f} px "
      "(deviation {:.0f}), as if rooms were stretched: check the intrinsics (hm calibrate camera)",
      camera.fx, focal.ratio * camera.fx, focal.sigma * camera.fx);
}

void add_warnings(const SlamRunOptions& options, SlamSummary& summary) {
  const SlamPipeline::State& state = summary.state;
  for (std::string& warning : warnings_of(state.track)) summary.warnings.push_back(std::move(warning));
  if (state.frames_disconnected > 0)
    summary.warnings.push_back(
        fmt::format("{} not in the map: no closed loop connects that part of the trajectory with its start",
                    counted(state.frames_disconnected, "frame")));
  if (state.correction.frames_lost > 0)
    summary.warnings.push_back(fmt::format("{} could not be read again when the map was rebuilt",
                                           counted(state.correction.frames_lost, "frame")));
  if (!state.alignment.failure.empty())
    summary.warnings.push_back(fmt::format("bundle adjustment failed ({}): poses are those of the pose graph",
                                           state.alignment.failure));
  if (state.alignment.observations_behind > 0)
    summary.warnings.push_back(
        fmt::format("bundle adjustment left out {} of landmarks behind the camera and used {}",
                    counted(state.alignment.observations_behind, "observation"),
                    with_thousands(state.alignment.observations)));
  if (state.alignment.refused)
    summary.warnings.push_back(fmt::format(
        "bundle adjustment was refused: with it, surfaces that different visits show are {:.1f} mm apart on "
        "average, by depth images and loops {:.1f} mm, which the poses now are by; calibrate the cameras if "
        "colour is not exactly registered to depth",
        1e3 * state.alignment.agreement.distance_m, 1e3 * state.alignment.agreement.other_distance_m));
  if (state.alignment.disparity.is_worth_a_calibration())
    summary.warnings.push_back(depth_warning(state.alignment.disparity));
  if (state.alignment.interrupted)
    summary.warnings.emplace_back(
        "bundle adjustment was stopped: poses are less accurate than they could be");
  if (state.alignment.disparity.interrupted)
    summary.warnings.emplace_back("stopped before the offset of the camera's disparity was estimated");
  if (state.alignment.focal_length.interrupted)
    summary.warnings.emplace_back("stopped before the focal length was checked");
  if (state.track.frames_read < state.frames_total && state.interrupted)
    summary.warnings.push_back(fmt::format("stopped after {} of {}", with_thousands(state.track.frames_read),
                                           counted(state.frames_total, "frame")));
  if (!state.up.known())
    summary.warnings.emplace_back(
        "up is unknown: there is no accelerometer, and floor and walls do not determine it; the map's z axis "
        "is "
        "the upward direction of the first image");
  if (options.parameters.loops.enabled && state.loops.accepted == 0 && state.track.keyframes.size() > 20)
    summary.warnings.emplace_back(
        "no place was recognised again, so no loop was closed: the trajectory is that of odometry");
}

void judge_slam(const Recording& recording, const SlamRunOptions& options, SlamSummary& summary) {
  const SlamPipeline::State& state = summary.state;
  judge_depth_visits(recording, state.corrected, options.run, summary.verdict);
  judge_tracking(state.track, summary.verdict);
  if (state.alignment.focal_length.seems_wrong())
    summary.verdict.add(MapVerdict::kDoubtful,
                        focal_length_doubt(state.alignment.focal_length, recording.camera()));
  if (state.frames_disconnected > 0)
    summary.verdict.add(
        MapVerdict::kDoubtful,
        fmt::format("{} not in the map: nothing joins that part of the trajectory with its start",
                    counted(state.frames_disconnected, "frame")));
}

}  // namespace

Result<void> finish_slam(const TrackedSlam& run, SlamSummary& summary) {
  SlamPipeline& pipeline = run.pipeline;
  const SlamRunOptions& options = run.options;
  pipeline.close_loops();
  if (pipeline.state().track.trajectory.empty())
    return tl::make_unexpected(nothing_tracked(options, pipeline.state(), summary.warnings));
  if (const auto found = check_recognised(options, pipeline.state()); !found) return found;
  pipeline.level();
  OdometryMesh before;
  const bool is_measured = has_mesh_truth(options.recording);
  const bool compare = options.compare_with_odometry &&
                       (is_measured || options.parameters.reconstruction.pictures) &&
                       !pipeline.state().continued;
  if (compare && pipeline.state().loops.accepted > 0)
    before = {pipeline.mesh_of_odometry(/*keyframes_alone=*/!is_measured), !is_measured};
  if (const auto corrected = pipeline.correct_dense_map(); !corrected) return corrected;
  summary.recording = run.recording.info();
  summary.parameters = options.parameters;
  summary.state = std::move(pipeline.state());
  summary.run_s = run.watch.seconds();
  compare_trajectories(summary);
  add_warnings(options, summary);
  judge_slam(run.recording, options, summary);
  summary.volumes_refused = pipeline.dense().grid().volumes_refused();
  judge_memory_limit(
      {"tsdf.max_map_mb", options.parameters.tsdf.max_map_mb, summary.volumes_refused, "block"},
      summary.warnings, summary.verdict);
  show_corrected(options.run, summary.state.corrected, *summary.state.keyframes);
  if (options.run.view) options.run.view->on_end(summary.verdict);
  SlamRunOptions staged = options;
  staged.output = run.staging;
  return as_run_failure(write_slam_results(pipeline, before, staged, summary));
}

}  // namespace hm
