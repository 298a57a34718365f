#pragma once
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "hm/core/run_context.hpp"
#include "hm/core/statistics.hpp"
#include "hm/evaluation/mesh_error.hpp"
#include "hm/geometry/level/up_direction.hpp"
#include "hm/io/rgbd/recording.hpp"
#include "hm/pipeline/common/result_folder.hpp"
#include "hm/pipeline/dense/dense_parameter_list.hpp"
#include "hm/pipeline/verdict/run_verdict.hpp"
#include "hm/report/summary_tree.hpp"
#include "hm/tsdf/alignment/dense_alignment.hpp"

namespace hm {

/// A recording to reconstruct, its parameters, and the folder of the results.
struct ReconstructionOptions {
  std::filesystem::path recording;
  RecordingOptions recording_options;
  std::filesystem::path poses;   ///< a trajectory to use instead of the recording's own poses; empty: none
  std::filesystem::path output;  ///< a folder, made if needed
  ExistingResult existing = ExistingResult::kRefuse;  ///< kResume goes on with output/map.hmap
  bool force = false;  ///< runs even where the recording looks unusable (check_before_run)
  DenseParameters parameters;
  RunContext run;  ///< stopped early, it finishes with what there is
};

/// A frame that is not in the map, and why.
struct SkippedFrame {
  std::size_t index = 0;
  std::string reason;
};

/// Time of one frame by stage, and the memory in use after it.
struct FrameRecord {
  std::size_t index = 0;
  double time_s = 0;  ///< since the start of the run
  double wait_ms = 0, align_ms = 0, allocate_ms = 0, integrate_ms = 0, carve_ms = 0, mesh_ms = 0, pack_ms = 0,
         save_ms = 0;
  double scan_ms = 0;                        ///< all of the integration
  std::optional<AlignmentStatus> alignment;  ///< with reconstruction.align
  double shift_m = 0;                        ///< by which alignment corrected the pose, since the last frame
  double rms_before_m = 0, rms_after_m = 0;  ///< distance of the depth image from the map
  std::size_t volumes = 0, resident_bytes = 0, map_bytes = 0, mesh_bytes = 0;
};

/// Result of aligning the given poses.
struct AlignmentSummary {
  std::size_t accepted = 0, not_accepted = 0;                     ///< frames, of all runs into this map
  Summary ms;                                                     ///< of this run
  std::map<AlignmentStatus, std::size_t> not_accepted_by_status;  ///< of this run
  Trajectory given;  ///< the poses as given, of the integrated frames
  /// Absolute trajectory error (rmse) of the given and of the aligned poses, where the true ones are known.
  std::optional<double> given_ate_m, aligned_ate_m;
};

/// Result of a run.
struct ReconstructionSummary {
  RecordingInfo recording;
  std::filesystem::path pose_source;  ///< file or files of the poses that it was built with
  DenseParameters parameters;
  int threads = 1;
  bool interrupted = false;
  bool resumed = false;
  bool already_complete =
      false;  ///< a resumed run had nothing left to do; the result is as it was, nothing else is set
  std::size_t resumed_at_frame = 0;

  std::size_t frames_total = 0;  ///< of the recording, within the parameters' range
  std::size_t frames_read = 0, frames_integrated = 0;
  std::vector<SkippedFrame> skipped;
  std::vector<FrameRecord> records;  ///< of this run; of more than 32,768 frames an even thinning
  std::size_t frames_this_run = 0;
  double run_s = 0, frames_per_s = 0;
  Summary integrate_ms, mesh_ms;

  std::size_t volumes = 0, map_bytes = 0, map_file_bytes = 0, volumes_refused = 0;
  std::size_t vertices = 0, triangles = 0;
  Box3 bounds_m;
  Trajectory trajectory;  ///< T_world_camera of the integrated frames
  UpDirection up;         ///< in the world of these poses
  bool levelled = false;  ///< reconstruction.level: the given poses were turned by this
  SE3 T_level_given;
  std::optional<AlignmentSummary> alignment;  ///< with reconstruction.align
  std::optional<MeshError> error;             ///< for a recording with a true mesh
  RunVerdict verdict;
  std::vector<std::string> warnings;
  std::vector<std::filesystem::path> outputs;
};

/// Depth and poses -> volumes -> coloured mesh (dissertation ch. 4): reads the recording ahead on a thread of
/// its own, integrates and meshes frame by frame, saves the map now and then, and writes mesh.*, map.hmap,
/// trajectory.tum, parameters.toml, report.json, report.html and pictures/. A run that was killed or
/// stopped and then resumed gives the same bits as one that was not. A result that is replaced stays whole
/// until the first save.
///
/// Errors: recording, poses or output folder unusable (see ResultFolder, check_before_run), no poses at all,
/// parameters that contradict, a map that does not fit the parameters, the poses or the recording, nothing
/// integrated at all. A frame that cannot be used is none: it is named in `skipped`.
///
/// The map is in the frame of the poses, and `up` is the up direction in it; with reconstruction.level the
/// poses are rotated to z up before integration, by a first pass over a part of the depth images.
Result<ReconstructionSummary> reconstruct(const ReconstructionOptions& options);

/// The parameters that a map was made with, to go on with it as it began.
Result<DenseParameters> parameters_of_map(const std::filesystem::path& map);

/// frames{read,integrated,skipped}, integrate_ms{median,p99}, volumes ... (the keys of `hm reconstruct
/// --json`).
void visit(const ReconstructionSummary& summary, SummaryTree& v);
/// A few lines for a terminal.
std::string to_text(const ReconstructionSummary& summary);

}  // namespace hm
