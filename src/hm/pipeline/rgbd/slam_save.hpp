#pragma once
#include <filesystem>
#include <future>
#include <optional>
#include <string>
#include <vector>

#include "hm/core/stopwatch.hpp"
#include "hm/io/rgbd/recording.hpp"
#include "hm/mapping/map_copy.hpp"
#include "hm/pipeline/common/result_folder.hpp"
#include "hm/pipeline/rgbd/resume/slam_checkpoint.hpp"
#include "hm/pipeline/rgbd/rgbd_parameter_list.hpp"
#include "hm/pipeline/rgbd/slam_pipeline.hpp"

namespace hm {

/// Which run a map was saved by, and how far the run was.
struct SlamSaveState {
  std::string program_version;
  Time first_stamp;  ///< of the recording, and its number of frames: to recognise it
  std::size_t recording_frames = 0;
  std::size_t next_frame = 0;  ///< the first one that is not in the map
  UpDirection up = {};         ///< in the map; known at the end only
  MapSession session = {};

  /// Puts the program, the recording and its session into a checkpoint.
  void describe(SlamCheckpoint& checkpoint) const;
};

/// The header of a file with the map of a SLAM run.
MapHeader slam_map_header(const RgbdParameters& parameters, const VolumeGrid& grid,
                          const SlamSaveState& state);
/// A state at the start of a recording.
SlamSaveState initial_save_state(const RecordingInfo& info, const std::string& program_version,
                                 const RecordingOptions& options);
/// How far the run was that saved a map; 0 where there is no map. Errors: not a map of `hm slam`, or of
/// another recording than `state`.
Result<std::size_t> frames_of_saved_slam(const std::filesystem::path& map, const SlamSaveState& state);

/// Whether a run with this recording and these parameters may continue a saved one: the same recording and
/// camera, and the same parameters of everything that tracking and keyframes depend on. Others may change,
/// since loops, map and mesh are made again. The error (kUsage) names what differs.
Result<void> check_continues(const SavedSlam& saved, const RecordingInfo& info, const PinholeCamera& camera,
                             const RgbdParameters& parameters, const std::filesystem::path& folder);

/// Saves a SLAM run while it goes on: every reconstruction.save_interval_s (or save_interval_frames) a copy
/// of the map as it is then, the trajectory of the frames up to then as loops place them now, and the state
/// from which the run can continue (SlamCheckpoint; its journal grows with every frame). All is written
/// beside the last save, by threads of its own; the next one begins at least twice as long after the last one
/// as that took, so that most of the time none is written. After a resume map and trajectory wait until the
/// map is whole again; the state does not.
class SlamSave {
 public:
  /// Pipeline and folder must outlive it. No map is saved before the run is further than `state`: what an
  /// interrupted run has saved stays until then.
  SlamSave(SlamPipeline& pipeline, ResultFolder& folder, const RgbdParameters& parameters,
           const SlamSaveState& state);
  ~SlamSave();

  /// Begins the journal, or continues that of a run that was resumed; before the first frame. Does nothing
  /// for a run that cannot be continued (SlamPipeline::can_be_saved).
  Result<void> begin_journal(const SavedSlam* resumed);
  /// To be called after every frame, with the index of the next one.
  Result<void> after_frame(std::size_t next_frame);
  /// At the end of tracking, before loops are closed: gives up a copy that is under way and saves the state.
  Result<void> end_of_tracking(std::size_t next_frame);
  /// At the end of the run: the final poses of keyframes go into the state. Its files are in the folder's
  /// staging(), or published already.
  Result<std::vector<std::filesystem::path>> finish(const CorrectedKeyframes& keyframes);

 private:
  [[nodiscard]] bool is_due() const;
  Result<void> begin(std::size_t next_frame);
  Result<void> begin_state(std::size_t next_frame);
  Result<bool> is_written();
  Result<void> publish();
  [[nodiscard]] Result<void> write_state() const;
  [[nodiscard]] std::filesystem::path staged(const char* name) const { return folder_.staging() / name; }

  SlamPipeline& pipeline_;
  ResultFolder& folder_;
  RgbdParameters parameters_;
  SlamSaveState state_;           ///< of the last copy
  std::size_t saved_frames_ = 0;  ///< of the last save, with or without a map
  std::optional<MapCopy> copy_;
  Trajectory trajectory_;  ///< that goes with the copy
  bool has_map_ = false;   ///< the save under way has one
  bool is_published_ = false;
  std::optional<SlamJournal> journal_;
  SlamCheckpoint checkpoint_;                         ///< of the last save
  std::optional<std::future<Result<void>>> written_;  ///< set while a save is under way
  std::size_t frames_since_save_ = 0;
  Stopwatch since_save_;
  double last_copy_s_ = 0;
};

}  // namespace hm
