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

/// Options that override what the folder says.
struct RecordingOptions {
  std::optional<RecordingKind> kind = {};        ///< instead of detection
  std::optional<PinholeCamera> camera = {};      ///< instead of the files' or the known camera
  std::optional<double> depth_units_per_m = {};  ///< instead of the format's own (1000, 5000)
  double max_stamp_difference_s = 0.02;          ///< between paired depth and colour images
  double max_pose_gap_s = 0.15;                  ///< largest gap between two poses for interpolation
  /// Calibration of both cameras (calibration_file.hpp); empty: calibration.toml of the folder, if present.
  std::filesystem::path calibration = {};
};

/// Metadata of a recording, read without decoding images.
struct RecordingInfo {
  RecordingKind kind = RecordingKind::kTumRgbd;
  std::filesystem::path path;
  PinholeCamera camera;  ///< of depth and colour, with the distortion of the files
  /// Description of the calibration applied to every image (`camera` is then the resulting one); empty
  /// without a calibration.
  std::string calibration;
  std::string camera_source;  ///< origin of the intrinsics, for the user
  double depth_unit_m = 1e-3;
  std::size_t frame_count = 0;  ///< depth images, in order
  std::size_t color_count = 0;
  std::vector<Time> stamps;                     ///< of the depth images; index / 30 Hz if not recorded
  std::vector<std::optional<SE3>> frame_poses;  ///< T_world_camera of each depth image, where known
  std::vector<Time> color_stamps;               ///< of the colour images, where they have their own
  bool has_own_stamps = true;
  Trajectory trajectory;          ///< poses as given (T_world_camera), possibly at another rate
  std::string trajectory_source;  ///< file or files of the poses
  std::string poses_unreadable;  ///< why a file of poses cannot be used: "groundtruth.txt:3: ..."; else empty
  Trajectory truth;              ///< the exact trajectory, where it differs from the given one
  std::optional<std::filesystem::path> truth_mesh;  ///< PLY of the true surface, if there is one
  std::size_t paired_count = 0;                     ///< depth images with a colour image
  std::size_t posed_count = 0;                      ///< depth images with a pose
  std::size_t missing_images = 0;                   ///< files that are listed but missing
  std::string first_missing_image;
  std::shared_ptr<const CarriedImu> imu;  ///< of an IMU mounted to the camera, if any
  std::vector<SkippedLines> skipped;      ///< skipped lines, also listed in notes
  std::string notes;                      ///< e.g. "60 lines of groundtruth.txt skipped", one per line
  /// Assumptions that may be wrong where the recording gives nothing (its camera, its units of depth):
  /// warnings of every run. They are among the notes too.
  std::vector<std::string> assumptions;
};

/// Recording on disk. Frames are read on request, in any order, from any thread.
class Recording : public FrameSource {
 public:
  [[nodiscard]] virtual const RecordingInfo& info() const = 0;
  /// Camera of the frames returned by read(): info().camera.without_distortion().
  [[nodiscard]] PinholeCamera camera() const override { return info().camera.without_distortion(); }
};

/// Opens a recording folder; its kind is recognised from the files in it:
/// - TUM RGB-D: depth.txt with rgb.txt, or associations.txt; groundtruth.txt. Poses are interpolated to the
///   stamp of the depth image; a file of poses that cannot be read is no error (`poses_unreadable`). If
///   poses.txt exists, it holds the poses reported by the device and becomes `trajectory`, and
///   groundtruth.txt becomes `truth`. truth_mesh.ply is the true surface. IMU measurements beside it
///   (carried_imu_file.hpp) become `imu`; unreadable ones are reported in the notes. Without these lists:
///   images by their names, and poses beside them (named_images.hpp).
/// - 7-Scenes: frame-XXXXXX.depth.png or .pgm, .color.png or .jpg, .pose.txt, in the folder or in its seq-XX
///   subfolder.
/// - ICL-NUIM: associations.txt with integer frame numbers instead of seconds.
///
/// A calibration (given, or calibration.toml in the folder) is applied to every image: rectification, depth
/// correction, registration of depth to the colour camera. A given camera replaces the folder's calibration.
/// If nothing fits, the error lists what was looked for.
Result<std::unique_ptr<Recording>> open_recording(const std::filesystem::path& path,
                                                  const RecordingOptions& options = {});

/// How frames are read ahead. Decoding the images of a frame takes several times as long as integrating them.
struct PrefetchOptions {
  std::size_t ahead = 4;    ///< most decoded frames that are held; at least one for each reader
  int readers = 1;          ///< threads that decode, besides those of the caller
  bool depth_only = false;  ///< colour is not needed: FrameSource::read_depth()
};

/// Reads frames ahead on other threads and gives them in order. Nothing is dropped.
class FramePrefetcher {
 public:
  FramePrefetcher(const Recording& recording, std::size_t begin, std::size_t end, std::size_t stride = 1,
                  const PrefetchOptions& options = {});
  /// Reads the frames with these indices, in this order.
  FramePrefetcher(const FrameSource& frames, std::vector<std::size_t> indices,
                  const PrefetchOptions& options = {});
  ~FramePrefetcher();
  FramePrefetcher(const FramePrefetcher&) = delete;
  FramePrefetcher& operator=(const FramePrefetcher&) = delete;
  /// Next frame, or the error of reading it; nothing at the end. Throws what reading
  /// threw (std::bad_alloc), at once and from then on.
  std::optional<Result<RgbdFrame>> next();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
