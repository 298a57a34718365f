#pragma once
#include <functional>
#include <vector>

#include "hm/sim/sensor/imu_sensor.hpp"

namespace hm {

/// Camera pose at a time after the start; must be smooth, and defined slightly before the start and after the
/// end.
using CarriedPose = std::function<SE3(double elapsed_s)>;

/// Rotation of a tablet's IMU in its camera frame: x right, y up, z towards the user.
Mat3 R_camera_tablet_imu();

/// Simulates the samples of an IMU at the camera's position, in the IMU frame, from `begin` for `duration_s`:
/// rates and accelerations by central differences of the poses, plus seeded noise and biases.
std::vector<ImuSample> carried_imu(const CarriedPose& pose, Time begin, double duration_s,
                                   const ImuSensorParams& params, const ImuSensorEffects& effects,
                                   std::uint64_t seed);

}  // namespace hm
