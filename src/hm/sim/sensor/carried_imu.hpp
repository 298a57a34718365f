#pragma once
#include <functional>
#include <vector>

#include "hm/sim/sensor/imu_sensor.hpp"

namespace hm {

/// How a camera is carried: its pose this long after the beginning (smooth; may be asked for a little before
/// and after).
using CarriedPose = std::function<SE3(double elapsed_s)>;

/// How the inertial device of a tablet is turned in its camera's frame: x right, y up, z towards the person.
Mat3 R_camera_tablet_imu();

/// What an inertial device at the camera's place feels, in its own frame, from `begin` for `duration_s`:
/// velocities and accelerations by central differences of the poses, then noise and biases by the seed.
std::vector<ImuSample> carried_imu(const CarriedPose& pose, Time begin, double duration_s,
                                   const ImuSensorParams& params, const ImuSensorEffects& effects,
                                   std::uint64_t seed);

}  // namespace hm
