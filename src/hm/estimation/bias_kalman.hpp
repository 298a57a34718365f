#pragma once
#include <Eigen/Core>

#include "hm/geometry/se2.hpp"

namespace hm {

/// Power spectral densities of the process noise: white noise of the input, and of the rate of change of its
/// bias.
struct NoiseDensity {
  double input = 0;  ///< (m/s^2)^2/Hz, or (rad/s)^2/Hz
  double bias = 0;   ///< (m/s^3)^2/Hz, or (rad/s^2)^2/Hz
};

/// Kalman filter of position, velocity and acceleration bias along N coupled axes: N = 1 for height, N = 2
/// for the plane, whose axes are coupled by the matcher's covariance and the rotating bias.
///
/// The dynamics are v' = R (a - bias) + noise, bias' = noise, where R rotates the vehicle's level frame (x
/// forward) into the world; the bias is a vector of the level frame, so that it also absorbs tilt errors.
template <int N>
struct BiasKalman {
  using Vector = Eigen::Matrix<double, N, 1>;
  using Matrix = Eigen::Matrix<double, N, N>;

  Vector position = Vector::Zero(), velocity = Vector::Zero(), bias = Vector::Zero();
  Matrix pp = Matrix::Zero(), pv = Matrix::Zero(), pb = Matrix::Zero();  ///< covariance, row of position
  Matrix vv = Matrix::Zero(), vb = Matrix::Zero(), bb = Matrix::Zero();
  bool ready = false;

  struct Start {
    double speed_std_m_s, bias_std_m_s2;
  };
  /// Initialises with the measured position, zero velocity and no correlation. An earlier bias estimate is
  /// kept.
  void start(const Vector& measured, const Matrix& covariance, const Start& unknown);

  /// Prediction (eqs 2.13, 2.15) with bias-corrected acceleration; process noise by Van Loan's method in
  /// closed form, for white acceleration noise and a random-walk bias.
  void predict(const Vector& acceleration_level, const Matrix& R_world_level, double dt_s,
               const NoiseDensity& noise);

  struct Innovation {
    Vector residual;
    Matrix inverse;  ///< of its covariance
    double chi2;
  };
  [[nodiscard]] Innovation innovation(const Vector& measured, const Matrix& covariance) const;
  void correct(const Innovation& innovation);
};

/// Kalman filter of yaw and its rate bias: yaw' = rate - bias + noise. The yaw stays in (-pi, pi].
struct YawBiasKalman {
  double yaw_rad = 0, bias_rad_s = 0;
  double yy = 0, yb = 0, bb = 0;  ///< covariance
  bool ready = false;

  void start(double measured_rad, double variance, double bias_std_rad_s);
  void predict(double rate_rad_s, double dt_s, const NoiseDensity& noise);
  struct Innovation {
    double residual, inverse, chi2;
  };
  [[nodiscard]] Innovation innovation(double measured_rad, double variance) const;
  void correct(const Innovation& innovation);
};

extern template struct BiasKalman<1>;
extern template struct BiasKalman<2>;

}  // namespace hm
