#pragma once
#include "hm/core/params.hpp"
#include "hm/geometry/trajectory.hpp"

namespace hm {

/// Error model of wheel odometry. Standard deviations are proportional to the motion of each step (Thrun,
/// Burgard, Fox, "Probabilistic Robotics", 5.4); the systematic errors are drawn once per call.
struct WheelNoiseParams {
  double along_ratio = 0.05, across_ratio = 0.02;
  double angle_ratio = 0.05, angle_rad_per_m = 0.02;
  double scale_sigma_ratio = 0.01, drift_sigma_rad_per_m = 0.01;
  int seed = 1;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"along_ratio", {0, 1}, "standard deviation along the motion, as a ratio of its length"},
      self.along_ratio);
    v(ParamDoc{"across_ratio", {0, 1}, "standard deviation across the motion, as a ratio of its length"},
      self.across_ratio);
    v(ParamDoc{"angle_ratio", {0, 1}, "standard deviation of a rotation, as a ratio of its angle"},
      self.angle_ratio);
    v(ParamDoc{"angle_rad_per_m", {0, 1}, "standard deviation of the heading per metre driven"},
      self.angle_rad_per_m);
    v(ParamDoc{"scale_sigma_ratio", {0, 1}, "standard deviation of the systematic scale error"},
      self.scale_sigma_ratio);
    v(
        ParamDoc{
            "drift_sigma_rad_per_m", {0, 1}, "standard deviation of the systematic heading drift per metre"},
        self.drift_sigma_rad_per_m);
    v(ParamDoc{"seed", {0, 2147483647}, "seed of the random numbers"}, self.seed);
  }
};

/// Simulates wheel odometry along a trajectory: planar relative motions with noise, accumulated from the
/// first pose. Height, roll and pitch are dropped. Reproducible for a given seed.
Trajectory degrade_to_wheel_odometry(const Trajectory& truth, const WheelNoiseParams& params = {});

}  // namespace hm
