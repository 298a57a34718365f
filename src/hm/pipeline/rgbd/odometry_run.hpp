#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "hm/core/run_context.hpp"
#include "hm/pipeline/common/result_folder.hpp"
#include "hm/pipeline/rgbd/visual_tracking.hpp"

namespace hm {

/// A recording to track, its parameters, and the folder of the results.
struct OdometryRunOptions {
  std::filesystem::path recording;
  RecordingOptions recording_options;
  std::filesystem::path output;  ///< a folder, made if needed
  ExistingResult existing = ExistingResult::kRefuse;
  bool force = false;  ///< runs even where the recording looks unusable (check_before_run)
  RgbdParameters parameters;
  RunContext run;  ///< stopped early, it finishes with what there is
};

/// Result of a run.
struct OdometrySummary {
  RecordingInfo recording;
  RgbdParameters parameters;
  bool interrupted = false;
  double run_s = 0;
  VisualTrack track;
  std::optional<TrajectoryError> error;  ///< for a recording with poses
  RunVerdict verdict;
  std::vector<std::string> warnings;
  std::vector<std::filesystem::path> outputs;
};

/// First pose of odometry: a camera held level at the origin of a frame whose z axis points up.
SE3 level_camera();

/// A recording -> the motion of its camera by visual odometry (dissertation 3.2): reads ahead on a thread of
/// its own, tracks, and writes trajectory.tum (frames with a pose), parameters.toml, report.json,
/// report.html. Poses of the recording are compared with, never used.
///
/// Errors: recording or output folder unusable, parameters that contradict, not a single pose. A frame that
/// cannot be used is none: it is named in `track.unused`.
Result<OdometrySummary> run_odometry(const OdometryRunOptions& options);

/// frames{read,tracked,lost}, track_ms{median,mean,p99}, path_length_m ... (the keys of `hm odometry
/// --json`).
void visit(const OdometrySummary& summary, SummaryTree& v);
/// A few lines for a terminal.
std::string to_text(const OdometrySummary& summary);

}  // namespace hm
