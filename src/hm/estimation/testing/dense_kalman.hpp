#pragma once
#include <Eigen/Core>

namespace hm {

/// Textbook Kalman filter on dense matrices, the reference for the filters of this room.
struct DenseKalman {
  Eigen::VectorXd x;
  Eigen::MatrixXd p;

  void predict(const Eigen::MatrixXd& a, const Eigen::VectorXd& input, const Eigen::MatrixXd& q);
  void correct(const Eigen::MatrixXd& h, const Eigen::VectorXd& residual, const Eigen::MatrixXd& r);
};

struct DiscreteModel {
  Eigen::MatrixXd a, q;
};

/// Discretises x' = F x + noise of spectral density `density` over dt_s (Van Loan 1978).
DiscreteModel van_loan(const Eigen::MatrixXd& f, const Eigen::MatrixXd& density, double dt_s);

}  // namespace hm
