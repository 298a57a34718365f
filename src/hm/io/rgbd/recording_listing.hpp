#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "hm/depth_camera/frame_calibration.hpp"
#include "hm/depth_camera/rgbd_calibration.hpp"
#include "hm/io/rgbd/recording.hpp"

/// Listing of a recording folder without decoding images: one function per layout.
namespace hm::detail {

/// Files, stamps and pose of one frame. An empty path: not in the recording.
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

/// Units of depth in the recordings of TUM and ICL-NUIM.
inline constexpr double kTumUnits_per_m = 5000;

/// Default intrinsics of a layout.
struct KnownCamera {
  std::optional<PinholeCamera> camera;
  std::string source;  ///< "the 7-Scenes camera"
  double depth_units_per_m = 1000;
  std::string note = {};          ///< for the user where this camera is used
  std::string assumption = {};    ///< the same where it may well be another
  bool is_scale_certain = false;  ///< the units are those of this data set whatever camera is given
};
/// Fills camera, camera_source and depth_unit_m of `info` from the first available of: options, camera.txt,
/// camera-intrinsics.txt, a file of another program (find_foreign_camera), the known camera. Returns the
/// frame rate (from camera.txt, else 30 Hz).
Result<double> choose_camera(RecordingInfo& info, const RecordingOptions& options, const KnownCamera& known);
/// Compares the camera's size with the first readable depth image, and scales the camera if they differ by a
/// common ratio; another difference is an error.
Result<void> fit_camera_to_images(RecordingListing& listing);

/// Warns where colour images have another shape than depth images, to which they are stretched.
void note_stretched_color(RecordingListing& listing);

/// Path of a file in the recording's folder; for a 7-Scenes sequence also in the parent folder.
std::optional<std::filesystem::path> find_beside(const std::filesystem::path& folder, const char* name);

struct FoundCalibration {
  std::filesystem::path path;
  RgbdCalibration calibration;
};
/// Reads the calibration from the options or the folder; its camera of the raw depth images replaces the
/// camera in `options`.
Result<std::optional<FoundCalibration>> find_calibration(const std::filesystem::path& folder,
                                                         RecordingOptions& options);
/// Updates the listing to calibrated frames: their camera, and the poses of that camera.
Result<FrameCalibration> apply_calibration(const FoundCalibration& found, RecordingListing& listing);

/// Hint for a path without a recording: what it is instead, or where recordings are ("4 recordings inside:
/// ..."); empty when unknown.
std::string hint_of_place(const std::filesystem::path& path);

void add_note(RecordingInfo& info, std::string_view note);
/// Adds to the assumptions, and to the notes.
void add_assumption(RecordingInfo& info, const std::string& assumption);
void add_skipped(RecordingInfo& info, const std::vector<SkippedLines>& skipped);

}  // namespace hm::detail
