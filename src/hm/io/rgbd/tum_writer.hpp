#pragma once
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/geometry/camera.hpp"
#include "hm/geometry/trajectory.hpp"
#include "hm/io/image/image_file.hpp"
#include "hm/sensors/imu.hpp"
#include "hm/sensors/rgbd_frame.hpp"

namespace hm {

/// Writes a recording in the layout of TUM RGB-D: rgb/ and depth/ PNG files, rgb.txt, depth.txt,
/// associations.txt (colour first), groundtruth.txt, camera.txt, and poses.txt when the device's own poses
/// differ from the truth. Stamps have 9 decimals, so that they are read back exactly, and name the image
/// files. Images are written immediately; the text files by finish(), or as append() says.
class TumWriter {
 public:
  /// Creates the folder (and its parents). Error when it already holds a recording, or cannot be written.
  /// `units_per_m` is the depth value of one metre (TUM: 5000); frames with another unit are converted,
  /// depths that do not fit into 16 bits become 0.
  static Result<TumWriter> create(const std::filesystem::path& folder, const PinholeCamera& camera,
                                  double units_per_m = 5000.0);
  /// Starts a recording that grows while a camera runs, or continues one: camera.txt is there from the start,
  /// rgb.txt and depth.txt grow with every frame (there is no associations.txt), so that a kill leaves a
  /// recording of all frames added before. What a kill cut off at the end of a list is removed. Error: the
  /// folder holds a recording of another camera or unit, or one that cannot be continued.
  static Result<TumWriter> append(const std::filesystem::path& folder, const PinholeCamera& camera,
                                  double units_per_m);
  TumWriter(TumWriter&&) noexcept;
  TumWriter& operator=(TumWriter&&) noexcept;
  ~TumWriter();

  /// Writes the frame's images; its pose, if any, becomes a line of groundtruth.txt. Depth stamps must
  /// increase; a frame without colour has no line in rgb.txt.
  Result<void> add(const RgbdFrame& frame, PngEffort effort = PngEffort::kFast);
  /// Stamp of the last depth image, also of one of an earlier run that is continued.
  [[nodiscard]] std::optional<Time> last_stamp() const;
  /// Files that were written since the last call, which finish() then does not sync to disk any more: the
  /// caller does (sync_files).
  std::vector<std::filesystem::path> take_unsynced();
  /// Sets the poses reported by the device (T_world_camera, with drift), written as poses.txt.
  void set_device_poses(Trajectory poses);
  /// Sets the exact trajectory, e.g. at a higher rate, to be written instead of the poses of the added
  /// frames.
  void set_ground_truth(Trajectory poses);
  /// Sets the IMU samples, in the IMU frame, written as imu.csv and imu.toml.
  void set_imu(std::vector<ImuSample> samples, const Mat3& R_camera_imu);
  /// Writes the text files and syncs everything to disk. Nothing may be added afterwards.
  Result<void> finish();

 private:
  struct Impl;
  explicit TumWriter(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Syncs files and folders to disk. Error: the first that cannot be.
Result<void> sync_files(const std::vector<std::filesystem::path>& paths);

/// Reads a frame back that a TumWriter has written into `folder`: the same bits. `written` has its stamps and
/// the unit of its depth image; its images are not used. An error names the image.
Result<RgbdFrame> read_written_frame(const std::filesystem::path& folder, const RgbdFrame& written);
/// The same without colour.
Result<RgbdFrame> read_written_depth(const std::filesystem::path& folder, const RgbdFrame& written);

}  // namespace hm
