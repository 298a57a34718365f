#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/io/rgbd/recording.hpp"
#include "hm/mapping/observation_log.hpp"
#include "hm/pipeline/rgbd/resume/slam_checkpoint.hpp"

namespace hm {

/// The frames of a saved run that its map had.
std::vector<Observation> mapped_frames(std::span<const TrackedRecord> records);

/// Offsets that place a frame's record among those of other recordings.
struct RecordShift {
  std::int64_t frames = 0;  ///< added to indices
  Duration time;            ///< added to stamps
  int submaps = 0;          ///< added to submaps
  /// Added to the ids of landmarks, which each recording numbers from 1 on.
  std::uint64_t landmarks = 0;
  SE3 T_map_odom;  ///< of its poses
};

/// A record, or a keyframe, as it is after the shift; the given one stays.
TrackedRecord shifted(const TrackedRecord& record, const RecordShift& shift);
std::shared_ptr<const Keyframe> shifted(const Keyframe& keyframe, const RecordShift& shift);

/// The result of an earlier run that another recording goes on in (hm slam --continue): its frames stand
/// before those of the new recording in time and among the submaps, in the frame of the saved map. Frame i of
/// the earlier recordings has the index i + the number of frames of the new one, which keep theirs.
struct EarlierMap {
  std::filesystem::path folder;
  std::vector<TrackedRecord> records;
  std::vector<MapSession> sessions;
  /// Recording of each session; null where it cannot be read any more, which `warnings` say.
  std::vector<std::unique_ptr<Recording>> recordings;
  std::vector<std::string> warnings;
  std::size_t frames_of_new = 0;  ///< of the new recording
  Time first_stamp_of_new;
  RecordShift of_new;  ///< of its frames, to stand behind the others; their indices stay

  [[nodiscard]] std::vector<std::shared_ptr<const Keyframe>> keyframes() const;
  /// The frames of the dense map that can still be read.
  [[nodiscard]] std::vector<Observation> mapped_frames() const;
  /// The number of frames of all sessions.
  [[nodiscard]] std::size_t frame_count() const;
  /// The recording of a frame of an earlier session, and its index there; null: none, or not readable.
  struct FrameOfSession {
    const Recording* recording = nullptr;
    std::size_t index = 0;
  };
  [[nodiscard]] FrameOfSession recording_of(std::size_t index) const;
};

/// Reads the saved map of `folder`, which is not changed, for a new recording that begins at its frame
/// `first_frame`. Errors: no state of a SLAM run there (kNotFound), another version, damaged, of another
/// camera (kUsage), without a keyframe.
Result<EarlierMap> read_earlier_map(const std::filesystem::path& folder, const Recording& recording,
                                    std::size_t first_frame);

/// The frames of the new recording and of the earlier ones, by the indices of EarlierMap. Both must outlive
/// it.
class FramesOfSessions final : public FrameSource {
 public:
  FramesOfSessions(const Recording& recording, const EarlierMap& earlier)
      : recording_(recording), earlier_(earlier) {}
  [[nodiscard]] PinholeCamera camera() const override { return recording_.camera(); }
  [[nodiscard]] Result<RgbdFrame> read(std::size_t index) const override {
    return read_with(&FrameSource::read, index);
  }
  [[nodiscard]] Result<RgbdFrame> read_depth(std::size_t index) const override {
    return read_with(&FrameSource::read_depth, index);
  }

 private:
  [[nodiscard]] Result<RgbdFrame> read_with(Result<RgbdFrame> (FrameSource::*how)(std::size_t) const,
                                            std::size_t index) const;
  const Recording& recording_;
  const EarlierMap& earlier_;
};

/// Writes slam_journal.bin and slam_state.bin of the joined map into a folder. The journal is written frame
/// by frame, so that memory does not grow with the new recording.
class JoinedState {
 public:
  /// Begins the journal with the records of the earlier recordings. `earlier` must outlive it.
  static Result<JoinedState> begin(const EarlierMap& earlier, const std::filesystem::path& folder);
  /// Appends a frame of the new recording, as its tracking gave it. Error: this or an earlier one could not
  /// be written, as far as it is known by now (AppendFile::written()).
  [[nodiscard]] Result<void> add(const TrackedRecord& record);
  /// Writes the state. The checkpoint is that of the new run; its index of frames, its places and its
  /// sessions become those of all. Returns both files, or the first error of writing one.
  Result<std::vector<std::filesystem::path>> finish(SlamCheckpoint checkpoint);

 private:
  JoinedState(const EarlierMap& earlier, std::filesystem::path folder, SlamJournal journal)
      : earlier_(&earlier), folder_(std::move(folder)), journal_(std::move(journal)) {}
  const EarlierMap* earlier_;
  std::filesystem::path folder_;
  SlamJournal journal_;
};

}  // namespace hm
