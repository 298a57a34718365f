#pragma once
#include <array>
#include <string_view>

#include "hm/estimation/alpha_beta.hpp"
#include "hm/estimation/decoupled_kalman.hpp"
#include "hm/estimation/delayed_fusion.hpp"
#include "hm/estimation/filter_types.hpp"
#include "hm/estimation/tilt_filter.hpp"

namespace hm {

/// Choice of filters: those of the dissertation as published (alpha-beta, then Kalman on arrival), or those
/// with physical noise, biases, gates and delay compensation.
enum class FusionMode : std::uint8_t { kThesis, kDelayAware };
inline constexpr std::array<std::string_view, 2> kFusionModeNames{"thesis", "delay_aware"};

/// Parameters of the fusion of IMU, laser pose and height (dissertation 2.2.4).
template <class Scalar>
struct BasicStateEstimatorParams {
  FusionMode mode = FusionMode::kDelayAware;
  BasicFusionParams<Scalar> fusion;
  BasicTiltFilterParams<Scalar> tilt;
  BasicDecoupledKalmanParams<Scalar> thesis;
  BasicAlphaBetaParams<Scalar> pose_alpha_beta;
  BasicAlphaBetaParams<Scalar> height_alpha_beta{Scalar(0.9), Scalar(0.9), Scalar(0.5)};

  /// Visits only its own members; `fusion` and `tilt` have their own sections. The gains of the published
  /// filters are those of the dissertation, and no parameters.
  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"mode",
               {},
               "thesis: filters as published; delay_aware: with biases, gates and delay compensation"},
      self.mode, kFusionModeNames);
  }
};
using StateEstimatorParams = BasicStateEstimatorParams<double>;

/// Pose of the IMU on the vehicle.
template <class Scalar>
struct ImuMounting {
  FilterMatrix<Scalar, 3> R_base_imu = FilterMatrix<Scalar, 3>::Identity();
  FilterVector<Scalar, 3> p_base_imu_m = FilterVector<Scalar, 3>::Zero();
};

/// Estimates the state of the vehicle (position, angles, velocity) at the rate of the IMU, from IMU, laser
/// poses and heights (dissertation 2.2.4). StateEstimator (vehicle_estimator.hpp) is the one for a host, in
/// double precision; BoardEstimator the one for a microcontroller.
///
/// Roll and pitch come from the IMU's orientation if a sample has one, else from gyroscope and gravity; yaw
/// comes from the laser, extrapolated with the gyroscope. Inputs of one kind must be in order of stamps;
/// poses and heights may be late (kDelayAware), and early ones wait until IMU data reaches them. Without an
/// IMU call `advance`. No heap allocation, no exceptions. Not thread safe.
template <class Scalar, FusionCapacity kCapacity>
class BasicStateEstimator {
 public:
  using Params = BasicStateEstimatorParams<Scalar>;
  using Vector3 = FilterVector<Scalar, 3>;

  [[gnu::cold]] explicit BasicStateEstimator(const Params& params = {},
                                             const ImuMounting<Scalar>& mounting = {});

  /// Adds an IMU sample, valid for the interval since the previous sample.
  FusionStatus add_imu(const InertialReading<Scalar>& sample);
  FusionStatus add_pose(const PoseReading<Scalar>& pose);
  FusionStatus add_height(const BasicHeightReading<Scalar>& height);
  /// Predicts to `stamp` without IMU data, with constant velocity.
  FusionStatus advance(Time stamp);

  /// State at the newest IMU sample (or call of `advance`).
  [[nodiscard]] BasicVehicleState<Scalar> state() const;
  [[nodiscard]] const FusionCounts& pose_counts() const;
  [[nodiscard]] const FusionCounts& height_counts() const;
  [[nodiscard]] const FusionCounts& imu_counts() const { return imu_counts_; }

 private:
  struct BodyReading {
    Vector3 angular_velocity_base_rad_s, specific_force_base_m_s2;
  };
  [[nodiscard]] Vector3 gravity_felt(const Vector3& specific_force_base_m_s2, Scalar dt_s);
  void follow_laser_velocity(const PoseReading<Scalar>& pose);
  void update_tilt(const InertialReading<Scalar>& sample, const BodyReading& reading, Scalar dt_s);
  FusionStatus step(const BasicFusionInput<Scalar>& input, Scalar dt_s);
  FusionStatus add_pose_as_published(const PoseReading<Scalar>& pose);
  void fill_published_state(BasicVehicleState<Scalar>& state) const;

  Params params_;
  ImuMounting<Scalar> mounting_;
  BasicDelayedFusion<Scalar, kCapacity> fusion_;
  BasicTiltFilter<Scalar> tilt_;
  BasicAccelerationCompensator<Scalar> gravity_;
  AlphaBetaFilter<2, Scalar> laser_velocity_;  // from laser poses only, for gravity_
  BasicDecoupledKalman<Scalar> thesis_;
  AlphaBetaFilter<2, Scalar> thesis_position_;
  BasicAlphaBetaAngle<Scalar> thesis_yaw_;
  AlphaBetaFilter<1, Scalar> thesis_height_;
  bool thesis_planar_ready_ = false, thesis_height_ready_ = false;
  FusionCounts thesis_poses_, thesis_heights_, imu_counts_;

  bool any_time_ = false;
  Time stamp_;
  Vector3 roll_pitch_yaw_rad_ = Vector3::Zero();  // yaw: from the IMU only, unused
  Vector3 angular_velocity_rad_s_ = Vector3::Zero();
};
using BoardEstimator = BasicStateEstimator<float, kBoardCapacity>;

extern template class BasicStateEstimator<double, kHostCapacity>;
extern template class BasicStateEstimator<float, kBoardCapacity>;

}  // namespace hm
