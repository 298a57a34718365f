#include "hm/sim/recording/reported_poses.hpp"

#include <array>
#include <cmath>

#include "hm/sim/office/wheel_errors.hpp"

namespace hm {
namespace {

/// Ornstein-Uhlenbeck process over path length: an error correlated over some metres.
class SmoothError {
 public:
  explicit SmoothError(double sigma) : sigma_(sigma) {}
  double advance(double step_m, Rng& rng) {
    constexpr double kCorrelation_m = 8;
    const double keep = std::exp(-step_m / kCorrelation_m);
    value_ = keep * value_ + sigma_ * std::sqrt(1 - keep * keep) * rng.normal();
    return value_;
  }

 private:
  double sigma_;
  double value_ = 0;
};

/// Heading of a camera's optical axis.
double heading_rad(const SE3& T_world_camera) {
  const Vec3 forward = T_world_camera.rotation().col(2);
  return std::atan2(forward.y(), forward.x());
}

SE2 on_floor(const SE3& T_world_camera) {
  return {T_world_camera.translation().head<2>(), heading_rad(T_world_camera)};
}

}  // namespace

std::vector<SE3> poses_of_visual_inertial_odometry(const std::vector<SE3>& truth, const PoseDrift& drift,
                                                   std::uint64_t seed) {
  Rng rng(seed, 0x6472696674);
  SmoothError yaw_rate(drift.yaw_rad_m);
  std::array<SmoothError, 3> velocity = {SmoothError(drift.velocity_ratio), SmoothError(drift.velocity_ratio),
                                         SmoothError(drift.velocity_ratio)};
  std::vector<SE3> reported = {truth.front()};
  double yaw = 0;
  Vec3 position = truth.front().translation();
  for (std::size_t i = 1; i < truth.size(); ++i) {
    const Vec3 step = truth[i].translation() - truth[i - 1].translation();
    const double length = step.norm();
    const Vec3 error(velocity[0].advance(length, rng), velocity[1].advance(length, rng),
                     velocity[2].advance(length, rng));
    yaw += yaw_rate.advance(length, rng) * length;
    const Mat3 turn = so3_exp(Vec3(0, 0, yaw));
    position += turn * (step + error * length);
    reported.emplace_back(turn * truth[i].rotation(), position);
  }
  return reported;
}

std::vector<SE3> poses_of_wheels(const std::vector<SE3>& truth, std::uint64_t seed) {
  WheelErrors wheels(Rng(seed, 0x776865656c73));
  std::vector<SE3> reported = {truth.front()};
  SE2 T_odom_base = on_floor(truth.front());
  for (std::size_t i = 1; i < truth.size(); ++i) {
    const SE2 now = on_floor(truth[i]);
    T_odom_base = T_odom_base * wheels.measure(on_floor(truth[i - 1]).inverse() * now);
    const Mat3 turn = so3_exp(Vec3(0, 0, T_odom_base.angle() - now.angle()));
    reported.emplace_back(turn * truth[i].rotation(),
                          Vec3(T_odom_base.x(), T_odom_base.y(), truth[i].translation().z()));
  }
  return reported;
}

}  // namespace hm
