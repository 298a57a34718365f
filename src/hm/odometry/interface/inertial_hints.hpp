#pragma once
#include <memory>

#include "hm/odometry/interface/odometry_params.hpp"
#include "hm/odometry/interface/visual_odometry.hpp"
#include "hm/sensors/imu.hpp"

namespace hm {

/// Turns the readings of an inertial device into what is known of the motion from frame to frame.
class InertialHints {
 public:
  /// Null or kOff: there is nothing to tell.
  InertialHints(std::shared_ptr<const CarriedImu> imu, ImuUse use) : imu_(std::move(imu)), use_(use) {}
  /// Of the time since the last call's stamp (at the first call nothing): the rotation by the gyroscope, and
  /// the mean of the accelerometer. Nothing where the readings do not span the time or leave a gap in it.
  MotionHint next(Time stamp);

 private:
  std::shared_ptr<const CarriedImu> imu_;
  ImuUse use_;
  std::optional<Time> last_;
};

}  // namespace hm
