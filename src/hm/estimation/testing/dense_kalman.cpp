#include "hm/estimation/testing/dense_kalman.hpp"

#include <Eigen/LU>

namespace hm {
namespace {

/// Matrix exponential by its series with scaling and squaring.
Eigen::MatrixXd matrix_exponential(const Eigen::MatrixXd& m) {
  const Eigen::MatrixXd small = m / 1024;
  Eigen::MatrixXd term = Eigen::MatrixXd::Identity(m.rows(), m.cols()), sum = term;
  for (int i = 1; i < 20; ++i) {
    term = term * small / i;
    sum += term;
  }
  for (int i = 0; i < 10; ++i) sum = (sum * sum).eval();
  return sum;
}

}  // namespace

void DenseKalman::predict(const Eigen::MatrixXd& a, const Eigen::VectorXd& input, const Eigen::MatrixXd& q) {
  x = a * x + input;
  p = a * p * a.transpose() + q;
}

void DenseKalman::correct(const Eigen::MatrixXd& h, const Eigen::VectorXd& residual,
                          const Eigen::MatrixXd& r) {
  const Eigen::MatrixXd gain = p * h.transpose() * (h * p * h.transpose() + r).inverse();
  x += gain * residual;
  const Eigen::MatrixXd rest = Eigen::MatrixXd::Identity(x.size(), x.size()) - gain * h;
  p = rest * p * rest.transpose() + gain * r * gain.transpose();
}

DiscreteModel van_loan(const Eigen::MatrixXd& f, const Eigen::MatrixXd& density, double dt_s) {
  const Eigen::Index n = f.rows();
  Eigen::MatrixXd block = Eigen::MatrixXd::Zero(2 * n, 2 * n);
  block << -f, density, Eigen::MatrixXd::Zero(n, n), f.transpose();
  const Eigen::MatrixXd e = matrix_exponential(block * dt_s);
  const Eigen::MatrixXd a = e.bottomRightCorner(n, n).transpose();
  return {a, a * e.topRightCorner(n, n)};
}

}  // namespace hm
