#pragma once
#include <filesystem>
#include <optional>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/sensors/imu.hpp"

namespace hm {

/// The readings of the inertial device beside an RGB-D recording, turned into the frame of its camera;
/// nothing where there are none. Looked for, in this order:
/// - imu.csv, imu0.csv, imu0/data.csv, mav0/imu0/data.csv: lines `nanoseconds,wx,wy,wz,ax,ay,az` (ASL, EuRoC)
///   in the device's frame; imu.toml says how that is turned in the camera's ([imu] rpy_deg; none: not).
/// - accelerometer.txt: lines `seconds ax ay az` (TUM RGB-D), of a Kinect, whose device is turned by 180
///   degrees about the optical axis; readings that only repeat the one before are left out.
/// Errors name the file, or file and line.
Result<std::optional<CarriedImu>> read_carried_imu(const std::filesystem::path& folder);

/// Writes imu.csv and imu.toml. The samples are in the device's frame.
Result<void> write_carried_imu(const std::filesystem::path& folder, const std::vector<ImuSample>& samples,
                               const Mat3& R_camera_imu);

}  // namespace hm
