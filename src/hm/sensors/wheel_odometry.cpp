#include "hm/sensors/wheel_odometry.hpp"

#include <cmath>
#include <cstdint>

#include "hm/core/rng.hpp"
#include "hm/geometry/se2.hpp"

namespace hm {

Trajectory degrade_to_wheel_odometry(const Trajectory& truth, const WheelNoiseParams& given) {
  const WheelNoiseParams params = given.multiplied();
  Rng rng(static_cast<std::uint64_t>(params.seed));
  const double scale = 1 + rng.normal(0, params.scale_sigma_ratio);
  const double drift_rad_per_m = rng.normal(0, params.drift_sigma_rad_per_m);
  Trajectory odometry;
  SE2 T_odom_base, last;
  for (const StampedPose& pose : truth) {
    const SE2 now = SE2::from_se3(pose.T_world_base);
    if (odometry.empty()) {
      T_odom_base = now;
    } else {
      const SE2 motion = last.inverse() * now;
      const double length_m = motion.translation().norm();
      const double along = scale * (1 + rng.normal(0, params.along_ratio));
      const double slip = rng.normal(0, params.across_ratio);
      const double turn = motion.angle() * (1 + rng.normal(0, params.angle_ratio)) +
                          length_m * (drift_rad_per_m + rng.normal(0, params.angle_rad_per_m));
      const Vec2 across(-motion.y(), motion.x());
      T_odom_base = T_odom_base * SE2(along * motion.translation() + slip * across, turn);
    }
    odometry.push_back({pose.stamp, T_odom_base.to_se3()});
    last = now;
  }
  return odometry;
}

}  // namespace hm
