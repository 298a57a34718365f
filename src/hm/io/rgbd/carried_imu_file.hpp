#pragma once
#include <filesystem>
#include <optional>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/sensors/imu.hpp"

namespace hm {

/// Reads the IMU measurements beside an RGB-D recording, rotated into the frame of its camera; nothing if
/// there are none. Files are tried in this order:
/// - imu.csv, imu0.csv, imu0/data.csv, mav0/imu0/data.csv: lines `nanoseconds,wx,wy,wz,ax,ay,az` (ASL, EuRoC)
///   in the device's frame; imu.toml gives its rotation in the camera frame ([imu] rpy_deg; default:
///   identity).
/// - accelerometer.txt: lines `seconds ax ay az` (TUM RGB-D), of a Kinect, whose accelerometer is rotated by
///   180 degrees about the optical axis; repeated readings are skipped.
/// Errors name the file, or file and line.
Result<std::optional<CarriedImu>> read_carried_imu(const std::filesystem::path& folder);

/// Writes imu.csv and imu.toml. The samples are in the IMU frame.
Result<void> write_carried_imu(const std::filesystem::path& folder, const std::vector<ImuSample>& samples,
                               const Mat3& R_camera_imu);
/// Writes measurements in the camera's frame: imu.csv and imu.toml, or accelerometer.txt without gyroscope.
Result<void> write_carried_imu(const std::filesystem::path& folder, const CarriedImu& imu);

}  // namespace hm
