#pragma once
#include <optional>

#include "hm/geometry/se2.hpp"

namespace hm {

/// Motion since a scan, as predicted and as wheels measured it.
struct MotionSince {
  SE2 T_odom_base;  ///< pose of that scan
  /// Of (x, y, angle) of that pose relative to its keyframe, x and y along the axes of `odom`.
  Mat3 covariance = Mat3::Zero();
  SE2 predicted = {};                 ///< in the base frame of that scan
  std::optional<SE2> wheels = SE2();  ///< uncorrected; nothing where they have not measured all of it

  /// Adds the motion since the last one, in the base frame before it: composed on the right.
  void add(const SE2& motion, const std::optional<SE2>& by_wheels) {
    predicted = predicted * motion;
    if (wheels && by_wheels)
      wheels = *wheels * *by_wheels;
    else
      wheels.reset();
  }
  [[nodiscard]] SE2 pose() const { return T_odom_base * predicted; }
};

}  // namespace hm
