#include "hm/sim/sensor/carried_imu.hpp"

namespace hm {
namespace {

constexpr double kHalfStep_s = 0.01;  // of the differences

FlightState motion_at(const CarriedPose& pose, double elapsed_s) {
  const SE3 before = pose(elapsed_s - kHalfStep_s), after = pose(elapsed_s + kHalfStep_s);
  FlightState state;
  state.T_world_base = pose(elapsed_s);
  const Vec3& p = state.T_world_base.translation();
  state.velocity_world_m_s = (after.translation() - before.translation()) / (2 * kHalfStep_s);
  state.acceleration_world_m_s2 =
      (after.translation() - 2 * p + before.translation()) / (kHalfStep_s * kHalfStep_s);
  state.angular_velocity_base_rad_s =
      so3_log(before.rotation().transpose() * after.rotation()) / (2 * kHalfStep_s);
  return state;  // the device is at the origin: angular accelerations have no effect
}

}  // namespace

Mat3 R_camera_tablet_imu() { return Vec3(1, -1, -1).asDiagonal(); }

std::vector<ImuSample> carried_imu(const CarriedPose& pose, Time begin, double duration_s,
                                   const ImuSensorParams& params, const ImuSensorEffects& effects,
                                   std::uint64_t seed) {
  ImuSensorParams sensor = params;
  sensor.imu_orientation = false;
  ImuErrors errors(sensor, effects, seed);
  std::vector<ImuSample> samples;
  const auto count = static_cast<std::size_t>(duration_s * sensor.imu_rate_hz) + 1;
  for (std::size_t i = 0; i < count; ++i) {
    const double elapsed_s = static_cast<double>(i) / sensor.imu_rate_hz;
    ImuSample exact = exact_imu(motion_at(pose, elapsed_s), SE3(R_camera_tablet_imu(), Vec3::Zero()));
    exact.stamp = begin + Duration::from_seconds(elapsed_s);
    samples.push_back(errors.next(exact));
  }
  return samples;
}

}  // namespace hm
