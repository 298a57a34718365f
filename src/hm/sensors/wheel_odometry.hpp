#pragma once
#include "hm/core/params.hpp"
#include "hm/geometry/trajectory.hpp"

namespace hm {

/// Error model of wheel odometry. Standard deviations are proportional to the motion of each step (Thrun,
/// Burgard, Fox, "Probabilistic Robotics", 5.4); the systematic errors are drawn once per call.
struct WheelNoiseParams {
  /// Standard deviation along the motion, as a ratio of its length.
  double along_ratio = 0.05;
  /// Standard deviation across the motion, as a ratio of its length.
  double across_ratio = 0.02;
  /// Standard deviation of a rotation, as a ratio of its angle.
  double angle_ratio = 0.05;
  /// Standard deviation of the heading per metre driven.
  double angle_rad_per_m = 0.02;
  /// Standard deviation of the systematic scale error.
  double scale_sigma_ratio = 0.01;
  /// Standard deviation of the systematic heading drift per metre.
  double drift_sigma_rad_per_m = 0.01;
  int seed = 1;
  double strength = 1;  ///< factor of all of the above but the seed

  /// The same noise with the factor multiplied in.
  [[nodiscard]] WheelNoiseParams multiplied() const {
    return {strength * along_ratio,
            strength * across_ratio,
            strength * angle_ratio,
            strength * angle_rad_per_m,
            strength * scale_sigma_ratio,
            strength * drift_sigma_rad_per_m,
            seed};
  }

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"seed", {0, 2147483647}, "seed of the random numbers"}, self.seed);
    v(ParamDoc{"strength", {0, 100}, "factor of the noise's deviations; 0: the true poses"}, self.strength);
  }
};

/// Simulates wheel odometry along a trajectory: planar relative motions with noise, accumulated from the
/// first pose. Height, roll and pitch are dropped. Reproducible for a given seed.
Trajectory degrade_to_wheel_odometry(const Trajectory& truth, const WheelNoiseParams& params = {});

}  // namespace hm
