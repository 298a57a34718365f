#pragma once
#include <array>
#include <optional>

#include "hm/estimation/alpha_beta.hpp"
#include "hm/estimation/decoupled_kalman.hpp"
#include "hm/estimation/delayed_fusion.hpp"
#include "hm/estimation/tilt_filter.hpp"
#include "hm/sensors/imu.hpp"

namespace hm {

/// Choice of filters: those of the dissertation as published (alpha-beta, then Kalman on arrival), or those
/// with physical noise, biases, gates and delay compensation.
enum class FusionMode { kThesis, kDelayAware };
inline constexpr std::array<std::string_view, 2> kFusionModeNames{"thesis", "delay_aware"};

/// Parameters of the fusion of IMU, laser pose and height (dissertation 2.2.4).
struct StateEstimatorParams {
  FusionMode mode = FusionMode::kDelayAware;
  FusionParams fusion;
  TiltFilterParams tilt;
  DecoupledKalmanParams thesis;
  AlphaBetaParams pose_alpha_beta;
  AlphaBetaParams height_alpha_beta{0.9, 0.9, 0.5};

  /// Visits only its own members; `fusion`, `tilt`, `thesis` and the alpha-beta filters have their own
  /// sections.
  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"mode",
               {},
               "thesis: filters as published; delay_aware: with biases, gates and delay compensation"},
      self.mode, kFusionModeNames);
  }
};

/// Estimates the state of the vehicle (position, angles, velocity) at the rate of the IMU, from IMU, laser
/// poses and heights (dissertation 2.2.4).
///
/// Roll and pitch come from the IMU's orientation if a sample has one, else from gyroscope and gravity; yaw
/// comes from the laser, extrapolated with the gyroscope. Inputs of one kind must be in order of stamps;
/// poses and heights may be late (kDelayAware), and early ones wait until IMU data reaches them. Without an
/// IMU call `advance`. No heap allocation, no exceptions; the object is large (about 150 kB). Not thread
/// safe.
class StateEstimator {
 public:
  explicit StateEstimator(const StateEstimatorParams& params = {}, const SE3& T_base_imu = {});

  /// Adds an IMU sample, valid for the interval since the previous sample.
  FusionStatus add_imu(const ImuSample& sample);
  FusionStatus add_pose(const PlanarPose& pose);
  FusionStatus add_height(const HeightReading& height);
  /// Predicts to `stamp` without IMU data, with constant velocity.
  FusionStatus advance(Time stamp);

  /// State at the newest IMU sample (or call of `advance`).
  [[nodiscard]] VehicleState state() const;
  [[nodiscard]] FusionCounts pose_counts() const;
  [[nodiscard]] FusionCounts height_counts() const;
  [[nodiscard]] const FusionCounts& imu_counts() const { return imu_counts_; }

 private:
  struct Reading {
    Vec3 angular_velocity_base_rad_s, specific_force_base_m_s2;
  };
  [[nodiscard]] Vec3 gravity_felt(const Vec3& specific_force_base_m_s2, double dt_s);
  void follow_laser_velocity(const PlanarPose& pose);
  void update_tilt(const ImuSample& sample, const Reading& reading, double dt_s);
  FusionStatus step(const FusionInput& input, double dt_s);
  [[nodiscard]] VehicleState thesis_state() const;

  StateEstimatorParams params_;
  SE3 T_base_imu_;
  DelayedFusion fusion_;
  TiltFilter tilt_;
  AccelerationCompensator gravity_;
  AlphaBetaFilter<2> laser_velocity_;  // from laser poses only, for gravity_
  Time laser_velocity_since_;
  DecoupledKalman thesis_;
  AlphaBetaFilter<2> thesis_position_;
  AlphaBetaAngle thesis_yaw_;
  AlphaBetaHeight thesis_height_;
  bool thesis_planar_ready_ = false, thesis_height_ready_ = false;
  FusionCounts thesis_poses_, thesis_heights_, imu_counts_;

  bool any_time_ = false;
  Time stamp_;
  Vec3 roll_pitch_yaw_rad_ = Vec3::Zero();  // yaw: from the IMU only, unused
  Vec3 angular_velocity_rad_s_ = Vec3::Zero();
};

}  // namespace hm
