#pragma once
#include <filesystem>
#include <optional>
#include <string>

#include "hm/core/stopwatch.hpp"
#include "hm/io/rgbd/recording.hpp"
#include "hm/mapping/map_copy.hpp"
#include "hm/pipeline/common/result_folder.hpp"
#include "hm/pipeline/rgbd/rgbd_parameters.hpp"
#include "hm/pipeline/rgbd/slam_pipeline.hpp"

namespace hm {

/// Which run a map was saved by, and how far the run was.
struct SlamSaveState {
  std::string program_version;
  Time first_stamp;  ///< of the recording, and its number of frames: to recognise it
  std::size_t recording_frames = 0;
  std::size_t next_frame = 0;  ///< the first one that is not in the map
  UpDirection up = {};         ///< in the map; known at the end only
};

/// The header of a file with the map of a SLAM run.
MapHeader slam_map_header(const RgbdParameters& parameters, const VolumeGrid& grid,
                          const SlamSaveState& state);
/// A state at the start of a recording.
SlamSaveState initial_save_state(const RecordingInfo& info, const std::string& program_version);
/// How far the run was that saved a map; 0 where there is no map. Errors: not a map of `hm slam`, or of
/// another recording than `state`.
Result<std::size_t> frames_of_saved_slam(const std::filesystem::path& map, const SlamSaveState& state);

/// Saves a SLAM run while it goes on: every reconstruction.save_interval_s (or save_interval_frames) a copy
/// of the map as it is then, and the trajectory of the frames up to then as loops place them now. Copies are
/// written whole, beside the last one, by a thread of its own; the next one begins at least twice as long
/// after the last one as that took, so that most of the time none is written.
class SlamSave {
 public:
  /// Pipeline and folder must outlive it. Nothing is saved before the run is further than `state`: what an
  /// interrupted run has saved stays until then.
  SlamSave(SlamPipeline& pipeline, ResultFolder& folder, const RgbdParameters& parameters,
           const SlamSaveState& state);

  /// To be called after every frame, with the index of the next one.
  Result<void> after_frame(std::size_t next_frame);
  /// Gives up a copy that is under way.
  void stop() { copy_.reset(); }

 private:
  [[nodiscard]] bool is_due() const;
  Result<void> begin(std::size_t next_frame);
  Result<void> publish();

  SlamPipeline& pipeline_;
  ResultFolder& folder_;
  RgbdParameters parameters_;
  SlamSaveState state_;  ///< of the last copy
  std::optional<MapCopy> copy_;
  Trajectory trajectory_;  ///< that goes with the copy
  std::size_t frames_since_save_ = 0;
  Stopwatch since_save_;
  double last_copy_s_ = 0;
};

}  // namespace hm
