#pragma once
#include <filesystem>
#include <string>

#include "hm/core/result.hpp"
#include "hm/depth_camera/rgbd_calibration.hpp"

namespace hm {

/// The name under which readers look for a calibration in a recording's folder.
inline constexpr const char* kCalibrationFileName = "calibration.toml";

/// Reads a calibration, a TOML file; every table is optional, but one of the cameras must be there:
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
///     [depth_disparity]            # where depth pictures hold raw disparity d: z = 1 / (offset + slope d)
///     offset_per_m = 3.33
///     slope_per_m = -0.00307
///     [depth_correction]
///     file = "depth_correction.hmdc"   # beside this file
///
/// Errors name file and line: no TOML, an unknown key, a wrong type or number; a correction that is named but
/// is not there, is damaged, or belongs to another image size.
Result<RgbdCalibration> read_calibration(const std::filesystem::path& path);

/// Writes the same, whole or not at all, and the correction (if any) beside it as NAME.hmdc after the file's
/// name.
Result<void> write_calibration(const std::filesystem::path& path, const RgbdCalibration& calibration);

/// A depth correction as bytes: `HMDEPTH1`, numbers (little endian), FNV-1a checksum. Reading bytes that are
/// cut off, damaged or no model is an error.
Result<DepthCorrectionModel> read_depth_correction(const std::filesystem::path& path);
Result<void> write_depth_correction(const std::filesystem::path& path, const DepthCorrectionModel& model);

/// A camera as ROS writes it (camera_info YAML of camera_calibration: plumb_bob, R = I, P = [K | 0]).
std::string camera_info_yaml(const PinholeCamera& camera, const std::string& name);

}  // namespace hm
