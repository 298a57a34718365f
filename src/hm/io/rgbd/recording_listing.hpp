#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "hm/depth_camera/frame_calibration.hpp"
#include "hm/depth_camera/rgbd_calibration.hpp"
#include "hm/io/rgbd/recording.hpp"

/// What lies in a recording folder, before any picture is decoded: one function per layout.
namespace hm::detail {

/// One frame, as files. An empty path: the recording has none.
struct ListedFrame {
  std::filesystem::path depth;
  std::filesystem::path color;
  Time stamp;
  Time color_stamp;
  std::optional<SE3> T_world_camera;
};

struct RecordingListing {
  RecordingInfo info;
  std::vector<ListedFrame> frames;
};

bool looks_like_tum(const std::filesystem::path& folder);
bool looks_like_icl_nuim(const std::filesystem::path& folder);
bool looks_like_seven_scenes(const std::filesystem::path& folder);

Result<RecordingListing> list_tum(const std::filesystem::path& folder, const RecordingOptions& options);
Result<RecordingListing> list_icl_nuim(const std::filesystem::path& folder, const RecordingOptions& options);
Result<RecordingListing> list_seven_scenes(const std::filesystem::path& folder,
                                           const RecordingOptions& options);

/// Intrinsics that go without saying for a layout.
struct KnownCamera {
  std::optional<PinholeCamera> camera;
  std::string source;  ///< "the 7-Scenes camera"
  double depth_units_per_m = 1000;
  std::string note = {};  ///< for the user where the camera is a guess
};
/// Fills camera, camera_source and depth_unit_m of `info`: the options before camera.txt before
/// camera-intrinsics.txt before the known camera. Returns the frame rate (from camera.txt, else 30 Hz).
Result<double> choose_camera(RecordingInfo& info, const RecordingOptions& options, const KnownCamera& known);
/// Compares the camera's size with the first depth picture that can be read, and scales the camera where
/// they differ by a common ratio.
Result<void> fit_camera_to_pictures(RecordingListing& listing);

/// A file beside the recording's pictures; for a sequence of 7-Scenes also in the folder above.
std::optional<std::filesystem::path> find_beside(const std::filesystem::path& folder, const char* name);

struct FoundCalibration {
  std::filesystem::path path;
  RgbdCalibration calibration;
};
/// The calibration that is given or lies in the folder; its camera of the raw depth pictures becomes the
/// given one.
Result<std::optional<FoundCalibration>> find_calibration(const std::filesystem::path& folder,
                                                         RecordingOptions& options);
/// Makes the listing that of calibrated frames: their camera, and the poses of that camera.
Result<FrameCalibration> apply_calibration(const FoundCalibration& found, RecordingListing& listing);

/// For a path that holds no recording: what it is instead, or where recordings are, in words ("4 recordings
/// inside: ..."); empty when nothing is known.
std::string hint_of_place(const std::filesystem::path& path);

void add_note(RecordingInfo& info, std::string_view note);
void add_skipped(RecordingInfo& info, const std::vector<SkippedLines>& skipped);

}  // namespace hm::detail
