#pragma once
#include <filesystem>
#include <string>

#include "hm/core/result.hpp"
#include "hm/depth_camera/rgbd_calibration.hpp"

namespace hm {

/// Name of the calibration file in a recording's folder.
inline constexpr const char* kCalibrationFileName = "calibration.toml";

/// Reads a calibration (TOML). All tables are optional, but at least one camera is required:
///
///     poses_of = "color"           # whose poses recordings give: "color" (default) or "depth"
///     [depth_camera]               # infrared; pixels, plumb-bob distortion as in OpenCV and ROS
///     size_px = [640, 480]
///     fx_px = 578.9                # also fy_px, cx_px, cy_px
///     distortion = [0, 0, 0, 0, 0] # k1 k2 p1 p2 k3
///     [color_camera]               # the same
///     [T_color_depth]              # points of the depth camera in the colour camera
///     xyz_m = [-0.026, 0, 0.0006]
///     quaternion_xyzw = [0, 0, 0, 1]
///     [depth_disparity]            # where depth images hold raw disparity d: z = 1 / (offset + slope d)
///     offset_per_m = 3.33
///     slope_per_m = -0.00307
///     [depth_correction]
///     file = "depth_correction.hmdc"   # beside this file
///
/// Errors name file and line: invalid TOML, an unknown key, a wrong type or number; a depth correction file
/// that is missing, damaged, or for another image size.
Result<RgbdCalibration> read_calibration(const std::filesystem::path& path);

/// Writes a calibration atomically, and its depth correction (if any) beside it as NAME.hmdc, where NAME is
/// the file's stem.
Result<void> write_calibration(const std::filesystem::path& path, const RgbdCalibration& calibration);

/// Reads or writes a binary depth correction (`.hmdc`): `HMDEPTH1`, numbers (little endian), FNV-1a checksum.
/// Truncated, damaged or invalid contents are an error.
Result<DepthCorrectionModel> read_depth_correction(const std::filesystem::path& path);
Result<void> write_depth_correction(const std::filesystem::path& path, const DepthCorrectionModel& model);

/// Camera as ROS camera_info YAML (as camera_calibration writes it: plumb_bob, R = I, P = [K | 0]).
std::string camera_info_yaml(const PinholeCamera& camera, const std::string& name);

}  // namespace hm
