#pragma once
#include <Eigen/Core>

#include "hm/estimation/filter_math.hpp"

namespace hm {

/// Power spectral densities of the process noise: white noise of the input, and of the rate of change of its
/// bias.
template <class Scalar>
struct BasicNoiseDensity {
  Scalar input = 0;  ///< (m/s^2)^2/Hz, or (rad/s)^2/Hz
  Scalar bias = 0;   ///< (m/s^3)^2/Hz, or (rad/s^2)^2/Hz
};
using NoiseDensity = BasicNoiseDensity<double>;

/// Kalman filter of position, velocity and acceleration bias along N coupled axes: N = 1 for height, N = 2
/// for the plane, whose axes are coupled by the matcher's covariance and the rotating bias.
///
/// The dynamics are v' = R (a - bias) + noise, bias' = noise, where R rotates the vehicle's level frame (x
/// forward) into the world; the bias is a vector of the level frame, so that it also absorbs tilt errors.
template <int N, class Scalar = double>
struct BiasKalman {
  using Vector = FilterVector<Scalar, N>;
  using Matrix = FilterMatrix<Scalar, N>;

  Vector position = Vector::Zero(), velocity = Vector::Zero(), bias = Vector::Zero();
  Matrix pp = Matrix::Zero(), pv = Matrix::Zero(), pb = Matrix::Zero();  ///< covariance, row of position
  Matrix vv = Matrix::Zero(), vb = Matrix::Zero(), bb = Matrix::Zero();
  bool ready = false;

  struct Start {
    Scalar speed_std_m_s, bias_std_m_s2;
  };
  /// Initialises with the measured position, zero velocity and no correlation. An earlier bias estimate is
  /// kept.
  void start(const Vector& measured, const Matrix& covariance, const Start& unknown);

  /// Prediction (eqs 2.13, 2.15) with bias-corrected acceleration; process noise by Van Loan's method in
  /// closed form, for white acceleration noise and a random-walk bias.
  void predict(const Vector& acceleration_level, const Matrix& R_world_level, Scalar dt_s,
               const BasicNoiseDensity<Scalar>& noise);

  struct Innovation {
    Vector residual;
    Matrix inverse;  ///< of its covariance
    Scalar chi2;
  };
  [[nodiscard]] Innovation innovation(const Vector& measured, const Matrix& covariance) const;
  void correct(const Innovation& innovation);
};

/// Kalman filter of yaw and its rate bias: yaw' = rate - bias + noise. The yaw stays in (-pi, pi].
template <class Scalar>
struct BasicYawBiasKalman {
  Scalar yaw_rad = 0, bias_rad_s = 0;
  Scalar yy = 0, yb = 0, bb = 0;  ///< covariance
  bool ready = false;

  void start(Scalar measured_rad, Scalar variance, Scalar bias_std_rad_s);
  void predict(Scalar rate_rad_s, Scalar dt_s, const BasicNoiseDensity<Scalar>& noise);
  struct Innovation {
    Scalar residual, inverse, chi2;
  };
  [[nodiscard]] Innovation innovation(Scalar measured_rad, Scalar variance) const;
  void correct(const Innovation& innovation);
};

using YawBiasKalman = BasicYawBiasKalman<double>;

extern template struct BiasKalman<1>;
extern template struct BiasKalman<2>;
extern template struct BiasKalman<1, float>;
extern template struct BiasKalman<2, float>;
extern template struct BasicYawBiasKalman<double>;
extern template struct BasicYawBiasKalman<float>;

}  // namespace hm
