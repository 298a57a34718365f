#pragma once
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/geometry/camera.hpp"
#include "hm/geometry/trajectory.hpp"
#include "hm/io/bytes/skipped_lines.hpp"
#include "hm/io/rgbd/frame_source.hpp"
#include "hm/sensors/imu.hpp"
#include "hm/sensors/rgbd_frame.hpp"

namespace hm {

enum class RecordingKind { kTumRgbd, kSevenScenes, kIclNuim };
std::string_view to_string(RecordingKind kind);

/// What the user may know better than the folder.
struct RecordingOptions {
  std::optional<RecordingKind> kind = {};        ///< instead of guessing
  std::optional<PinholeCamera> camera = {};      ///< instead of the files' or the known camera
  std::optional<double> depth_units_per_m = {};  ///< instead of the format's own (1000, 5000)
  double max_stamp_difference_s = 0.02;  ///< between a depth image and the colour image paired with it
  double max_pose_gap_s = 0.15;          ///< between two poses that one in the middle is interpolated from
  /// Calibration of both cameras (calibration_file.hpp); empty: calibration.toml of the folder, if there is
  /// one.
  std::filesystem::path calibration = {};
};

/// What a recording says about itself, read without decoding a picture.
struct RecordingInfo {
  RecordingKind kind = RecordingKind::kTumRgbd;
  std::filesystem::path path;
  PinholeCamera camera;  ///< of depth and colour, with the distortion of the files
  /// What is applied to every picture (`camera` is then what comes out of it), in words; empty without a
  /// calibration.
  std::string calibration;
  std::string camera_source;  ///< where the intrinsics come from, in words
  double depth_unit_m = 1e-3;
  std::size_t frame_count = 0;  ///< depth images, in order
  std::size_t color_count = 0;
  std::vector<Time> stamps;  ///< of the depth images; by index and 30 Hz where there are none
  std::vector<std::optional<SE3>> frame_poses;  ///< T_world_camera of each depth image, where known
  std::vector<Time> color_stamps;               ///< of the colour images, where they have their own
  bool has_own_stamps = true;
  Trajectory trajectory;          ///< poses as given (T_world_camera), possibly at another rate
  std::string trajectory_source;  ///< the file or files they come from
  Trajectory truth;               ///< the exact trajectory, where it differs from the given one
  std::optional<std::filesystem::path> truth_mesh;  ///< PLY of the true surface, if there is one
  std::size_t paired_count = 0;                     ///< depth images with a colour image
  std::size_t posed_count = 0;                      ///< depth images with a pose
  std::size_t missing_pictures = 0;                 ///< files that the lists name but that are not there
  std::string first_missing_picture;
  std::shared_ptr<const CarriedImu> imu;  ///< of the device that was carried along, if there was one
  std::vector<SkippedLines> skipped;      ///< lines that were left out, also told in notes
  std::string notes;                      ///< e.g. "60 lines of groundtruth.txt skipped", one a line
};

/// A recording on disk. Frames are read on request, in any order, from any thread.
class Recording : public FrameSource {
 public:
  [[nodiscard]] virtual const RecordingInfo& info() const = 0;
  /// The camera of the frames that read() gives: info().camera.without_distortion().
  [[nodiscard]] PinholeCamera camera() const override { return info().camera.without_distortion(); }
};

/// Opens a recording folder, guessing its kind from what lies in it:
/// - TUM RGB-D: depth.txt with rgb.txt, or associations.txt; groundtruth.txt. Poses are interpolated to the
///   stamp of the depth image. Where poses.txt exists too it is what the device itself reports: it becomes
///   `trajectory`, and groundtruth.txt `truth`. truth_mesh.ply is the true surface. Inertial readings beside
///   it (carried_imu_file.hpp) become `imu`; those that cannot be read are told in the notes.
/// - 7-Scenes: frame-XXXXXX.depth.png, .color.png or .jpg, .pose.txt, in the folder or in seq-XX below it.
/// - ICL-NUIM: associations.txt with whole frame numbers instead of seconds.
/// A calibration (given, or calibration.toml in the folder) is applied to every picture: rectified, depth
/// corrected, depth registered to the colour camera. A given camera replaces the folder's calibration.
/// Nothing that fits is an error saying what was looked for.
Result<std::unique_ptr<Recording>> open_recording(const std::filesystem::path& path,
                                                  const RecordingOptions& options = {});

/// Reads frames ahead on another thread, in order, holding at most `ahead` decoded frames. Nothing is
/// dropped.
class FramePrefetcher {
 public:
  FramePrefetcher(const Recording& recording, std::size_t begin, std::size_t end, std::size_t stride = 1,
                  std::size_t ahead = 4);
  /// The frames with these indices.
  FramePrefetcher(const FrameSource& frames, std::vector<std::size_t> indices, std::size_t ahead = 4);
  ~FramePrefetcher();
  FramePrefetcher(const FramePrefetcher&) = delete;
  FramePrefetcher& operator=(const FramePrefetcher&) = delete;
  /// The next frame, or the error that kept it from being read; nothing at the end.
  std::optional<Result<RgbdFrame>> next();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
