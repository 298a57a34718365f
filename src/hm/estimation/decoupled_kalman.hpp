#pragma once
#include <Eigen/Core>

#include "hm/estimation/filter_math.hpp"

namespace hm {

/// Noise of one position axis of the decoupled filters: `q` is added to the variances of position and
/// velocity at every prediction, independent of its duration; it has no physical unit.
template <class Scalar>
struct BasicAxisNoise {
  Scalar q = Scalar(0.083);
  Scalar r_position = Scalar(2.0);
  Scalar r_velocity = Scalar(10.0);
};
using AxisNoise = BasicAxisNoise<double>;

/// Parameters of the decoupled filters as published, with the values of their original implementation.
template <class Scalar>
struct BasicDecoupledKalmanParams {
  BasicAxisNoise<Scalar> x, y;
  BasicAxisNoise<Scalar> z{Scalar(0.7), Scalar(5.0), Scalar(10.0)};
  Scalar q_yaw = Scalar(0.083);  ///< process noise: added to the variance of yaw at every step
  Scalar r_yaw = Scalar(2.0);    ///< measurement noise variance of yaw

  /// Values used on the dissertation's vehicle.
  static BasicDecoupledKalmanParams city_flyer();
};
using DecoupledKalmanParams = BasicDecoupledKalmanParams<double>;

/// Kalman filter of one axis: state [position, velocity], input acceleration, measurement [position,
/// velocity] (dissertation eqs 2.9-2.11, 2.13-2.15). Noise is passed at every step, so that it can be changed
/// in flight.
template <class Scalar>
class BasicAxisKalman {
 public:
  using Vector = FilterVector<Scalar, 2>;
  using Matrix = FilterMatrix<Scalar, 2>;
  using Noise = BasicAxisNoise<Scalar>;
  /// Resets to the given state (default zero) and identity covariance.
  void reset(const Vector& state = Vector::Zero());
  void predict(Scalar acceleration_m_s2, Scalar dt_s, const Noise& noise);
  void correct(const Vector& measured, const Noise& noise);
  [[nodiscard]] const Vector& state() const { return state_; }
  [[nodiscard]] const Matrix& covariance() const { return covariance_; }
  /// Gain of the last correction.
  [[nodiscard]] const Matrix& gain() const { return gain_; }

 private:
  Vector state_ = Vector::Zero();
  Matrix covariance_ = Matrix::Identity(), gain_ = Matrix::Zero();
};
using AxisKalman = BasicAxisKalman<double>;

/// Kalman filter of yaw: one state, input the yaw rate (eqs 2.12, 2.16). The residual is wrapped to (-pi,
/// pi], the state to [0, 2 pi).
template <class Scalar>
class BasicYawKalman {
 public:
  void reset(Scalar yaw_rad = 0);
  void predict(Scalar yaw_rate_rad_s, Scalar dt_s, Scalar q);
  void correct(Scalar measured_yaw_rad, Scalar r);
  [[nodiscard]] Scalar yaw_rad() const { return yaw_rad_; }
  [[nodiscard]] Scalar variance() const { return variance_; }
  [[nodiscard]] Scalar gain() const { return gain_; }

 private:
  Scalar yaw_rad_ = 0, variance_ = 1, gain_ = 0;
};
using YawKalman = BasicYawKalman<double>;

/// The four filters together. No clock, no heap allocation; inputs that are not finite, and dt <= 0, change
/// nothing.
template <class Scalar>
class BasicDecoupledKalman {
 public:
  using Params = BasicDecoupledKalmanParams<Scalar>;
  using Vector2 = FilterVector<Scalar, 2>;
  using Vector3 = FilterVector<Scalar, 3>;
  using Axis = BasicAxisKalman<Scalar>;
  using Yaw = BasicYawKalman<Scalar>;
  explicit BasicDecoupledKalman(const Params& params = {}) : params_(params) {}
  /// Sets new noise, used from the next step on.
  void set_params(const Params& params) { params_ = params; }
  /// Resets states and covariances; velocities are zero.
  void reset_planar(const Vector2& position_m = Vector2::Zero(), Scalar yaw_rad = 0);
  void reset_height(Scalar height_m = 0);

  /// Predicts over `dt_s` (published: always 1 ms) with the acceleration in the world frame, gravity removed,
  /// and the gyroscope's yaw rate.
  void predict(const Vector3& acceleration_world_m_s2, Scalar yaw_rate_rad_s, Scalar dt_s);
  void correct_planar(const Vector2& position_m, const Vector2& velocity_m_s, Scalar yaw_rad);
  void correct_height(Scalar height_m, Scalar climb_m_s);

  [[nodiscard]] Vector3 position_m() const { return {x_.state()(0), y_.state()(0), z_.state()(0)}; }
  [[nodiscard]] Vector3 velocity_m_s() const { return {x_.state()(1), y_.state()(1), z_.state()(1)}; }
  [[nodiscard]] const Axis& x() const { return x_; }
  [[nodiscard]] const Axis& y() const { return y_; }
  [[nodiscard]] const Axis& z() const { return z_; }
  [[nodiscard]] const Yaw& yaw() const { return yaw_; }

 private:
  Params params_;
  Axis x_, y_, z_;
  Yaw yaw_;
};

using DecoupledKalman = BasicDecoupledKalman<double>;

}  // namespace hm
