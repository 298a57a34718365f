#pragma once
#include <Eigen/Core>

#include "hm/core/params.hpp"
#include "hm/geometry/se2.hpp"

namespace hm {

/// Noise of one position axis of the decoupled filters: `q` is added to the variances of position and
/// velocity at every prediction, independent of its duration; it has no physical unit.
struct AxisNoise {
  double q = 0.083;
  double r_position = 2.0;
  double r_velocity = 10.0;
};

/// Parameters of the decoupled filters as published, with the values of their original implementation.
struct DecoupledKalmanParams {
  AxisNoise x, y;
  AxisNoise z{0.7, 5.0, 10.0};
  double q_yaw = 0.083;
  double r_yaw = 2.0;

  /// Values used on the dissertation's vehicle.
  static DecoupledKalmanParams city_flyer();

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    const Range any{1e-9, 1e9};
    v(ParamDoc{"q_yaw", any, "process noise: added to the variance of yaw at every step"}, self.q_yaw);
    v(ParamDoc{"r_yaw", any, "measurement noise variance of yaw"}, self.r_yaw);
  }
};

/// Kalman filter of one axis: state [position, velocity], input acceleration, measurement [position,
/// velocity] (dissertation eqs 2.9-2.11, 2.13-2.15). Noise is passed at every step, so that it can be changed
/// in flight.
class AxisKalman {
 public:
  /// Resets to the given state (default zero) and identity covariance.
  void reset(const Vec2& state = Vec2::Zero());
  void predict(double acceleration_m_s2, double dt_s, const AxisNoise& noise);
  void correct(const Vec2& measured, const AxisNoise& noise);
  [[nodiscard]] const Vec2& state() const { return state_; }
  [[nodiscard]] const Mat2& covariance() const { return covariance_; }
  /// Gain of the last correction.
  [[nodiscard]] const Mat2& gain() const { return gain_; }

 private:
  Vec2 state_ = Vec2::Zero();
  Mat2 covariance_ = Mat2::Identity(), gain_ = Mat2::Zero();
};

/// Kalman filter of yaw: one state, input the yaw rate (eqs 2.12, 2.16). The residual is wrapped to (-pi,
/// pi], the state to [0, 2 pi).
class YawKalman {
 public:
  void reset(double yaw_rad = 0);
  void predict(double yaw_rate_rad_s, double dt_s, double q);
  void correct(double measured_yaw_rad, double r);
  [[nodiscard]] double yaw_rad() const { return yaw_rad_; }
  [[nodiscard]] double variance() const { return variance_; }
  [[nodiscard]] double gain() const { return gain_; }

 private:
  double yaw_rad_ = 0, variance_ = 1, gain_ = 0;
};

/// The four filters together. No clock, no heap allocation; inputs must be finite and dt > 0 (checked).
class DecoupledKalman {
 public:
  explicit DecoupledKalman(const DecoupledKalmanParams& params = {}) : params_(params) {}
  /// Sets new noise, used from the next step on.
  void set_params(const DecoupledKalmanParams& params) { params_ = params; }
  /// Resets states and covariances; velocities are zero.
  void reset_planar(const Vec2& position_m = Vec2::Zero(), double yaw_rad = 0);
  void reset_height(double height_m = 0);

  /// Predicts over `dt_s` (published: always 1 ms) with the acceleration in the world frame, gravity removed,
  /// and the gyroscope's yaw rate.
  void predict(const Vec3& acceleration_world_m_s2, double yaw_rate_rad_s, double dt_s);
  void correct_planar(const Vec2& position_m, const Vec2& velocity_m_s, double yaw_rad);
  void correct_height(double height_m, double climb_m_s);

  [[nodiscard]] Vec3 position_m() const { return {x_.state()(0), y_.state()(0), z_.state()(0)}; }
  [[nodiscard]] Vec3 velocity_m_s() const { return {x_.state()(1), y_.state()(1), z_.state()(1)}; }
  [[nodiscard]] const AxisKalman& x() const { return x_; }
  [[nodiscard]] const AxisKalman& y() const { return y_; }
  [[nodiscard]] const AxisKalman& z() const { return z_; }
  [[nodiscard]] const YawKalman& yaw() const { return yaw_; }

 private:
  DecoupledKalmanParams params_;
  AxisKalman x_, y_, z_;
  YawKalman yaw_;
};

}  // namespace hm
