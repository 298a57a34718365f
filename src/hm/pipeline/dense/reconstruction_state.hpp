#pragma once
#include <string>

#include "hm/io/map/map_file.hpp"
#include "hm/pipeline/dense/reconstruction.hpp"
#include "hm/tsdf/grid/volume.hpp"

namespace hm {

/// Progress of a reconstruction; stored in the map in the same transaction as its voxels.
struct ReconstructionState {
  std::string recording;  ///< path, for messages
  RecordingKind kind = RecordingKind::kTumRgbd;
  Time first_stamp;  ///< of the recording, to recognise it
  std::size_t next_frame = 0;
  std::size_t frames_read = 0, frames_integrated = 0, volumes_refused = 0;
  std::size_t frames_aligned = 0, frames_not_aligned = 0;
  SE3 T_map_input;    ///< see DensePipeline; of poses that are levelled already
  SE3 T_level_given;  ///< by which the given poses are turned (reconstruction.level)
  UpDirection up;     ///< in the map; found when a run has ended
  std::vector<SkippedFrame> skipped;
  Trajectory trajectory;                  ///< of the integrated frames, as they were integrated
  std::vector<VolumeKey> interior_marks;  ///< see MapSaver::MakeHeader
};

/// A state at the start of a recording.
ReconstructionState initial_state(const RecordingInfo& info, std::size_t first_frame);

std::string state_to_json(const ReconstructionState& state);
/// Reads what state_to_json wrote, exactly; `where` names the map in errors.
Result<ReconstructionState> state_from_json(std::string_view text, const std::string& where);

/// The most frequent reason, with its number ("12 x no pose"); of an empty list: that there was no frame.
std::string commonest_reason(const std::vector<SkippedFrame>& skipped);

/// An error that says what differs when a map was made with other parameters or from another recording, or
/// when the voxels of its header are not those of its parameters (`of_run`: the header that the run would
/// give a new map).
Result<void> check_resumable(const MapHeader& header, const MapHeader& of_run,
                             const ReconstructionState& state, const RecordingInfo& info,
                             const DenseParameters& parameters, const std::string& map_path);

}  // namespace hm
