#pragma once
#include <array>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/geometry/camera.hpp"
#include "hm/geometry/state_bytes.hpp"
#include "hm/io/rgbd/recording.hpp"
#include "hm/pipeline/rgbd/resume/slam_journal.hpp"
#include "hm/slam/rgbd/corrected_keyframes.hpp"

namespace hm {

/// Where a keyframe was in the map when the run was saved.
struct KeyframePlace {
  std::size_t frame_index = 0;
  int map = 0;  ///< CorrectedKeyframe::map
  SE3 T_map_camera;

  template <class Archive>
  void visit_state(Archive& archive) {
    archive(frame_index, map, T_map_camera);
  }
};

/// A recording that a map was made of, and how it was opened.
struct MapSession {
  std::string recording;     ///< its folder, absolute
  std::uint64_t frames = 0;  ///< that it has
  std::optional<int> kind;   ///< RecordingOptions, those that were given
  std::optional<double> depth_units_per_m;
  /// Width, height, fx, fy, cx, cy, k1, k2, p1, p2, k3.
  std::optional<std::array<double, 11>> camera;
  std::string calibration;

  /// A recording of so many frames that was opened with these options.
  static MapSession of(const std::filesystem::path& recording, const RecordingOptions& options,
                       std::size_t frames);
  [[nodiscard]] RecordingOptions options() const;

  template <class Archive>
  void visit_state(Archive& archive) {
    archive(recording, frames, kind, depth_units_per_m, camera, calibration);
    archive.require(!kind || (*kind >= 0 && *kind < 3));
  }
};

/// `slam_state.bin`: with the journal beside it, everything that a SLAM run needs to continue where it was
/// saved. It is bounded but for `places` (some hundred bytes a keyframe). Loops are not in it: they follow
/// from the journal's keyframes alone, and are closed again. Format: docs/file_formats.md.
struct SlamCheckpoint {
  std::string program_version;
  Time first_stamp;  ///< of the recording, and its number of frames: to recognise it
  std::uint64_t recording_frames = 0;
  PinholeCamera camera;          ///< of the images, without lens distortion
  std::string parameters_toml;   ///< of the run (list_slam)
  std::uint64_t next_frame = 0;  ///< the first one that the run has not looked at
  JournalMark journal;
  std::vector<KeyframePlace> places;   ///< as of the last solution; of a complete run: final
  std::vector<std::uint8_t> odometry;  ///< VisualTracking::save()
  /// The recordings of the map, in the order of their frames: one, or more after hm slam --continue.
  std::vector<MapSession> sessions;

  template <class Archive>
  void visit_state(Archive& archive) {
    archive(program_version, first_stamp, recording_frames, camera.width, camera.height, camera.fx, camera.fy,
            camera.cx, camera.cy, parameters_toml, next_frame, journal, places, odometry, sessions);
  }
};

/// SlamCheckpoint::places of these keyframes.
std::vector<KeyframePlace> keyframe_places(const CorrectedKeyframes& keyframes);

/// The bytes of a checkpoint's file.
std::vector<std::uint8_t> to_file_bytes(const SlamCheckpoint& checkpoint);
/// Reads such bytes; `where` names them in errors. Errors: not such a file, another version, damaged.
Result<SlamCheckpoint> parse_slam_checkpoint(std::span<const std::uint8_t> bytes, const std::string& where);

/// A run as it was saved.
struct SavedSlam {
  SlamCheckpoint checkpoint;
  std::vector<TrackedRecord> records;
};

/// Reads slam_state.bin and slam_journal.bin of a folder; nothing where it has no state.
Result<std::optional<SavedSlam>> read_slam_state(const std::filesystem::path& folder);
/// The same, to resume the run: every error says how to start anew.
Result<std::optional<SavedSlam>> read_saved_slam(const std::filesystem::path& folder);

/// An error of continuing a run, with the remedy added.
Error cannot_continue(Error error);

inline constexpr const char* kStartAnew = "start anew with --overwrite instead of --resume";
inline constexpr const char* kSlamStateName = "slam_state.bin";
inline constexpr const char* kSlamJournalName = "slam_journal.bin";

}  // namespace hm
