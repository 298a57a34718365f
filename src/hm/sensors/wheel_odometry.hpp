#pragma once
#include "hm/core/params.hpp"
#include "hm/geometry/trajectory.hpp"

namespace hm {

/// Errors of wheel odometry. Standard deviations grow with the motion of each step (Thrun, Burgard, Fox,
/// "Probabilistic Robotics", 5.4); the systematic errors are drawn once for the vehicle.
struct WheelNoiseParams {
  double along_ratio = 0.05, across_ratio = 0.02;
  double angle_ratio = 0.05, angle_rad_per_m = 0.02;
  double scale_sigma_ratio = 0.01, drift_sigma_rad_per_m = 0.01;
  int seed = 1;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"along_ratio", {0, 1}, "deviation along the motion, by its length"}, self.along_ratio);
    v(ParamDoc{"across_ratio", {0, 1}, "deviation across the motion, by its length"}, self.across_ratio);
    v(ParamDoc{"angle_ratio", {0, 1}, "deviation of a turn, by its angle"}, self.angle_ratio);
    v(ParamDoc{"angle_rad_per_m", {0, 1}, "deviation of the heading, by the length driven"},
      self.angle_rad_per_m);
    v(ParamDoc{"scale_sigma_ratio", {0, 1}, "deviation of the wheels' systematic error of scale"},
      self.scale_sigma_ratio);
    v(ParamDoc{"drift_sigma_rad_per_m", {0, 1}, "deviation of the systematic drift of the heading"},
      self.drift_sigma_rad_per_m);
    v(ParamDoc{"seed", {0, 2147483647}, "of the random numbers"}, self.seed);
  }
};

/// What wheel odometry would have said of a planar trajectory: the motion from each pose to the next with
/// noise, put together from the first pose on. Height, roll and pitch are taken away. Reproducible by its
/// seed.
Trajectory degrade_to_wheel_odometry(const Trajectory& truth, const WheelNoiseParams& params = {});

}  // namespace hm
