#pragma once
#include "hm/estimation/fusion_types.hpp"
#include "hm/estimation/state_estimator.hpp"
#include "hm/sensors/imu.hpp"

namespace hm {

/// BasicStateEstimator in double precision on the types of `sensors` and `geometry`. The object is large
/// (about 150 kB).
class StateEstimator {
 public:
  explicit StateEstimator(const StateEstimatorParams& params = {}, const SE3& T_base_imu = {})
      : filter_(params, {T_base_imu.rotation(), T_base_imu.translation()}) {}

  /// Adds an IMU sample, valid for the interval since the previous sample.
  FusionStatus add_imu(const ImuSample& sample) {
    return filter_.add_imu(
        {sample.stamp, sample.angular_velocity_rad_s, sample.specific_force_m_s2, sample.R_world_imu});
  }
  FusionStatus add_pose(const PlanarPose& pose) { return filter_.add_pose(pose.reading()); }
  FusionStatus add_height(const HeightReading& height) { return filter_.add_height(height); }
  /// Predicts to `stamp` without IMU data, with constant velocity.
  FusionStatus advance(Time stamp) { return filter_.advance(stamp); }

  /// State at the newest IMU sample (or call of `advance`).
  [[nodiscard]] VehicleState state() const { return {filter_.state()}; }
  [[nodiscard]] const FusionCounts& pose_counts() const { return filter_.pose_counts(); }
  [[nodiscard]] const FusionCounts& height_counts() const { return filter_.height_counts(); }
  [[nodiscard]] const FusionCounts& imu_counts() const { return filter_.imu_counts(); }

 private:
  BasicStateEstimator<double, kHostCapacity> filter_;
};

}  // namespace hm
