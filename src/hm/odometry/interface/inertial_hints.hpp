#pragma once
#include <memory>

#include "hm/odometry/interface/odometry_params.hpp"
#include "hm/odometry/interface/visual_odometry.hpp"
#include "hm/sensors/imu.hpp"

namespace hm {

/// Converts IMU measurements to motion hints from frame to frame.
class InertialHints {
 public:
  /// With a null `imu` or kOff, next() returns empty hints.
  InertialHints(std::shared_ptr<const CarriedImu> imu, ImuUse use);
  /// Use of this device: kAuto and kInertial as decided by it.
  [[nodiscard]] ImuUse use() const { return use_; }
  /// Returns the gyroscope's rotation and the mean specific force since the previous call (empty at the first
  /// one, and when the measurements do not cover the interval without gaps), or the readings themselves.
  MotionHint next(Time stamp);
  template <class Archive>
  void visit_state(Archive& archive) {
    archive(last_);
  }

 private:
  std::shared_ptr<const CarriedImu> imu_;
  ImuUse use_;
  std::optional<Time> last_;
};

}  // namespace hm
