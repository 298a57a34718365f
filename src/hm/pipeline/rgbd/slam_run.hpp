#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "hm/core/run_context.hpp"
#include "hm/evaluation/mesh_error.hpp"
#include "hm/pipeline/common/result_folder.hpp"
#include "hm/pipeline/rgbd/rgbd_parameter_list.hpp"
#include "hm/pipeline/rgbd/slam_pipeline.hpp"
#include "hm/pipeline/rgbd/slam_state.hpp"

namespace hm {

/// A recording to run, its parameters, and the folder of the results.
struct SlamRunOptions {
  std::filesystem::path recording;
  RecordingOptions recording_options;
  std::filesystem::path output;  ///< a folder, made if needed
  /// kResume: an interrupted run continues at the frame where its state was saved last, with the result of a
  /// run that was not interrupted. One without a state (SlamPipeline::can_be_saved) is repeated from its
  /// first frame; what it has saved stays until this one is further.
  ExistingResult existing = ExistingResult::kRefuse;
  /// The folder of an earlier result to go on in, which is only read; empty: a map of its own. The run ends
  /// with an error (kNoResult) and writes nothing unless it recognises that map.
  std::filesystem::path continued = {};
  bool force = false;                 ///< runs even where the recording looks unusable (check_before_run)
  bool compare_with_odometry = true;  ///< also makes the mesh of odometry's poses, for report and errors
  RgbdParameters parameters;
  RunContext run;  ///< asked to stop, it finishes with what there is, as right as ever
};

/// Outcome of the frames of a live camera (hm scan). Each captured frame was tracked, lost, not usable for
/// SLAM, or dropped for a reason.
struct CaptureSummary {
  std::string camera, intrinsics, exposure;
  std::string ended_because;
  std::size_t earlier_frames =
      0;  ///< of the recording that was continued, tracked again before the first one
  std::size_t captured = 0, tracked = 0, lost = 0, unusable = 0;
  std::size_t mapped = 0;  ///< of the tracked ones; the others came while the next one waited
  std::vector<std::pair<std::string, std::size_t>> dropped;  ///< by reason
  std::size_t recorded = 0, recorded_uncompressed = 0, not_recorded = 0;
  double duration_s = 0;            ///< from the first frame to the last
  double rate_hz = 0;               ///< of tracked frames
  Summary latency_ms;               ///< from having a frame to its pose, waiting included
  std::optional<double> saved_s{};  ///< unplugged: until recording, map and trajectory were on disk
};
/// captured, tracked, mapped, lost, unusable, dropped{total, reason: frames}, latency_ms{median,p99,max} ...
void visit(const CaptureSummary& capture, SummaryTree& v);
/// Dropped frames by reason: "queue_full 2, no_color 1"; empty: none.
std::string drops_text(const CaptureSummary& capture);
/// Lines for a terminal of a summary with these values below "capture".
std::string capture_lines(const SummaryTree& summary);

/// Result of a run.
struct SlamSummary {
  RecordingInfo recording;
  RgbdParameters parameters;
  double run_s = 0;
  std::optional<std::size_t> resumed_at_frame;  ///< the run continued an earlier one here
  std::optional<CaptureSummary> capture;        ///< the frames came from a live camera
  SlamPipeline::State state;

  std::optional<TrajectoryError> odometry_error, error;      ///< for a recording with poses: before, after
  std::optional<MeshError> odometry_mesh_error, mesh_error;  ///< for one with a true mesh: before, after
  std::size_t volumes = 0, map_bytes = 0, vertices = 0, triangles = 0;
  std::size_t volumes_refused = 0;  ///< not in the map because of its memory limit, counted each time
  Box3 bounds_m;
  RunVerdict verdict;
  std::vector<std::string> warnings;
  std::vector<std::filesystem::path> outputs;
};

/// A recording without poses -> trajectory, keyframes, loops, dense map (dissertation ch. 3 and 4): writes
/// trajectory.tum (corrected), odometry.tum, keyframes.tum, graph.g2o, mesh.*, map.hmap, the maps that
/// slam.maps names, parameters.toml, pictures/, report.json, report.html. Map and
/// trajectory are also saved while it runs (SlamSave), so that a kill leaves those of the last save. Poses of
/// the recording are compared with; the first one says where the map begins, if it is there
/// (slam.start_at_pose). With `continued` the map is that of both recordings, in the frame of the saved one;
/// trajectory and keyframes are those of this recording.
///
/// Errors: recording or output folder unusable, parameters that contradict, not a single pose. A frame that
/// cannot be used is none: it is named in `state.track.unused`.
Result<SlamSummary> run_slam(const SlamRunOptions& options);

/// frames{read,tracked,lost}, track_ms{median,mean,p99}, loops{candidates,accepted} ... (the keys of
/// `hm slam --json`).
void visit(const SlamSummary& summary, SummaryTree& v);
/// A few lines for a terminal.
std::string to_text(const SlamSummary& summary);

}  // namespace hm
