#pragma once
#include <optional>
#include <vector>

#include "hm/core/rng.hpp"
#include "hm/estimation/vehicle_estimator.hpp"

namespace hm {

/// Simulated flight at constant speed along a winding path, with noisy and biased IMU, delayed laser poses
/// and heights. The truth is exact (the path is the integral of the velocity).
struct LaserFlightParams {
  double duration_s = 20, speed_m_s = 2;
  double imu_hz = 1000, laser_hz = 40;
  double laser_delay_s = 0.06;
  double position_std_m = 0.01, yaw_std_rad = 0.003, height_std_m = 0.01;
  double acceleration_noise_m_s2 = 0.5, angular_rate_noise_rad_s = 0.02;  ///< of one sample
  Vec3 acceleration_bias_m_s2 = {0.1, -0.08, 0.15};
  double yaw_rate_bias_rad_s = 0.01;
  bool orientation_from_imu = true;
  std::uint64_t seed = 1;
};

struct FlightTruth {
  Vec3 position_m, velocity_m_s, acceleration_m_s2;
  Mat3 R_world_base;
};

class LaserFlight {
 public:
  explicit LaserFlight(const LaserFlightParams& params);
  /// IMU sample and the measurements that arrive with it.
  struct Step {
    ImuSample imu;
    std::optional<PlanarPose> pose;
    std::optional<HeightReading> height;
    FlightTruth truth;  ///< at the IMU's stamp
  };
  [[nodiscard]] const std::vector<Step>& steps() const { return steps_; }

 private:
  [[nodiscard]] FlightTruth truth_at(double time_s, const Vec3& position) const;
  LaserFlightParams params_;
  std::vector<Step> steps_;
};

/// Adds one step to the estimator, IMU first.
void feed(StateEstimator& estimator, const LaserFlight::Step& step);

/// Root mean square velocity error from `from_s` on.
double velocity_rmse_m_s(const LaserFlight& flight, const StateEstimatorParams& params, double from_s = 3);

}  // namespace hm
