// hm: compiled alone, as it takes as long as a unit of many files
#include "hm/estimation/bias_kalman.hpp"

#include <Eigen/LU>

namespace hm {

template <int N, class Scalar>
void BiasKalman<N, Scalar>::start(const Vector& measured, const Matrix& covariance, const Start& unknown) {
  const auto square = [](Scalar value) { return value * value; };
  position = measured;
  velocity.setZero();
  pp = covariance;
  vv = square(unknown.speed_std_m_s) * Matrix::Identity();
  if (!ready) bb = square(unknown.bias_std_m_s2) * Matrix::Identity();
  pv.setZero();
  pb.setZero();
  vb.setZero();
  ready = true;
}

/// P = A P A^T + Q with A = [I, d I, -d^2/2 R; 0, I, -d R; 0, 0, I], written out block by block.
template <int N, class Scalar>
void BiasKalman<N, Scalar>::predict(const Vector& acceleration_level, const Matrix& R_world_level,
                                    Scalar dt_s, const BasicNoiseDensity<Scalar>& noise) {
  const Scalar half = Scalar(0.5), d = dt_s, d2 = d * d, d3 = d2 * d;
  const Vector acceleration = R_world_level * (acceleration_level - bias);
  position += d * velocity + half * d2 * acceleration;
  velocity += d * acceleration;

  const Matrix bias_moves_velocity = d * R_world_level;
  const Matrix vb_next = vb - bias_moves_velocity * bb;
  const Matrix pb_next = pb + d * vb - half * d * (bias_moves_velocity * bb);
  const Matrix v_from_b = bias_moves_velocity * vb.transpose();
  const Matrix pv_before_bias = pv + d * vv - half * d * v_from_b;
  const Matrix pp_next = pp + d * pv.transpose() - half * d * (bias_moves_velocity * pb.transpose()) +
                         d * pv_before_bias - half * d * (pb_next * bias_moves_velocity.transpose());
  pv = pv_before_bias - pb_next * bias_moves_velocity.transpose();
  vv = vv - v_from_b - vb_next * bias_moves_velocity.transpose();
  pp = half * (pp_next + pp_next.transpose());
  vv = (half * (vv + vv.transpose())).eval();
  vb = vb_next;
  pb = pb_next;

  const Matrix identity = Matrix::Identity();
  pp += (noise.input * d3 / 3 + noise.bias * d3 * d2 / 20) * identity;
  pv += (noise.input * d2 / 2 + noise.bias * d2 * d2 / 8) * identity;
  vv += (noise.input * d + noise.bias * d3 / 3) * identity;
  pb -= noise.bias * d3 / 6 * R_world_level;
  vb -= noise.bias * d2 / 2 * R_world_level;
  bb += noise.bias * d * identity;
}

template <int N, class Scalar>
typename BiasKalman<N, Scalar>::Innovation BiasKalman<N, Scalar>::innovation(const Vector& measured,
                                                                             const Matrix& covariance) const {
  Innovation result;
  result.residual = measured - position;
  result.inverse = (pp + covariance).inverse();
  result.chi2 = result.residual.dot(result.inverse * result.residual);
  return result;
}

template <int N, class Scalar>
void BiasKalman<N, Scalar>::correct(const Innovation& innovation) {
  const Matrix gain_p = pp * innovation.inverse, gain_v = pv.transpose() * innovation.inverse,
               gain_b = pb.transpose() * innovation.inverse;
  position += gain_p * innovation.residual;
  velocity += gain_v * innovation.residual;
  bias += gain_b * innovation.residual;
  vv = (vv - gain_v * pv).eval();
  vb = (vb - gain_v * pb).eval();
  bb = (bb - gain_b * pb).eval();
  pv = (pv - gain_p * pv).eval();
  pb = (pb - gain_p * pb).eval();
  pp = (pp - gain_p * pp).eval();
  for (Matrix* block : {&pp, &vv, &bb}) *block = (Scalar(0.5) * (*block + block->transpose())).eval();
}

template <class Scalar>
void BasicYawBiasKalman<Scalar>::start(Scalar measured_rad, Scalar variance, Scalar bias_std_rad_s) {
  yaw_rad = wrap_angle(measured_rad);
  yy = variance;
  yb = 0;
  if (!ready) bb = bias_std_rad_s * bias_std_rad_s;
  ready = true;
}

template <class Scalar>
void BasicYawBiasKalman<Scalar>::predict(Scalar rate_rad_s, Scalar dt_s,
                                         const BasicNoiseDensity<Scalar>& noise) {
  const Scalar d = dt_s;
  yaw_rad = wrap_angle(yaw_rad + d * (rate_rad_s - bias_rad_s));
  yy += d * (d * bb - 2 * yb) + noise.input * d + noise.bias * d * d * d / 3;
  yb -= d * bb + noise.bias * d * d / 2;
  bb += noise.bias * d;
}

template <class Scalar>
typename BasicYawBiasKalman<Scalar>::Innovation BasicYawBiasKalman<Scalar>::innovation(
    Scalar measured_rad, Scalar variance) const {
  const Scalar residual = wrap_angle(measured_rad - yaw_rad), inverse = 1 / (yy + variance);
  return {residual, inverse, residual * residual * inverse};
}

template <class Scalar>
void BasicYawBiasKalman<Scalar>::correct(const Innovation& innovation) {
  const Scalar gain_y = yy * innovation.inverse, gain_b = yb * innovation.inverse;
  yaw_rad = wrap_angle(yaw_rad + gain_y * innovation.residual);
  bias_rad_s += gain_b * innovation.residual;
  bb -= gain_b * yb;
  yb -= gain_y * yb;
  yy -= gain_y * yy;
}

template struct BiasKalman<1>;
template struct BiasKalman<2>;
template struct BiasKalman<1, float>;
template struct BiasKalman<2, float>;
template struct BasicYawBiasKalman<double>;
template struct BasicYawBiasKalman<float>;

}  // namespace hm
