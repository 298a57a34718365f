// hm: compiled alone, as it takes as long as a unit of many files
#include <algorithm>
#include <array>
#include <cmath>

#include "hm/geometry/solvers/large_solvers.hpp"
#include "hm/odometry/inertial/inertial_window.hpp"

namespace hm {
namespace {

using MatX = Eigen::MatrixXd;
using VecX = Eigen::VectorXd;

constexpr int kWindowIterations = 4;
constexpr double kWindowConverged = 1e-6;
constexpr double kMaxDelay_s = 0.05;
constexpr double kSquaredMahalanobis = 16.81;  // chi-squared, six degrees of freedom, 99 %
constexpr double kLeastVisualInformation = 1;  // 1/m^2, 1/rad^2

// What is known before the first frame: biases of telephones, gravity from the first mean force (the camera
// may accelerate), delay.
constexpr double kGyroBiasSigma_rad_s = 0.02, kAccelBiasSigma_m_s2 = 0.3;
constexpr double kTiltSigma_rad = 0.5, kDelaySigma_s = 0.02;
// Random walks, per root of a second. That of the tilt is the drift of the visual poses.
constexpr double kGyroBiasWalk = 1e-4, kAccelBiasWalk = 3e-3, kTiltWalk_rad = 1e-3, kDelayWalk_s = 1e-4;

Mat9 common_covariance(double gyro, double accel, double tilt, double delay) {
  Vec9 sigma;
  sigma << Vec3::Constant(gyro), Vec3::Constant(accel), tilt, tilt, delay;
  return sigma.cwiseAbs2().asDiagonal();
}

Mat9 first_information() {
  return common_covariance(1 / kGyroBiasSigma_rad_s, 1 / kAccelBiasSigma_m_s2, 1 / kTiltSigma_rad,
                           1 / kDelaySigma_s);
}

}  // namespace

struct InertialWindow::Equations {
  explicit Equations(std::size_t frames)
      : common(static_cast<Eigen::Index>(9 * frames)),
        H(MatX::Zero(common + 9, common + 9)),
        g(VecX::Zero(common + 9)) {}

  void add(const Frame& frame, Eigen::Index row) {
    Mat6 information = frame.pose.information;
    information.diagonal().array() += kLeastVisualInformation;
    const Vec6 d = (frame.pose.T_odom_camera.inverse() * frame.state.T_odom_camera).log();
    const double squared = d.dot(information * d);
    const double weight = squared > kSquaredMahalanobis ? kSquaredMahalanobis / squared : 1.0;
    const Mat6 J = pose_by_state(frame.state.T_odom_camera.rotation());
    H.block<6, 6>(row, row) += weight * J.transpose() * information * J;
    g.segment<6>(row) += weight * J.transpose() * (information * d + frame.pose.gradient);
  }

  void add(const InertialResidual& residual, const Mat9& information, Eigen::Index first) {
    const std::array<const Mat9*, 3> by{&residual.by_first, &residual.by_second, &residual.by_common};
    const std::array<Eigen::Index, 3> rows{first, first + 9, common};
    for (std::size_t i = 0; i < 3; ++i) {
      const Mat9 weighted = by[i]->transpose() * information;
      g.segment<9>(rows[i]) += weighted * residual.value;
      for (std::size_t j = 0; j < 3; ++j) H.block<9, 9>(rows[i], rows[j]) += weighted * *by[j];
    }
  }

  void add(const Prior& prior, const InertialState& state, const InertialCommon& shared) {
    Vec18 d;
    d << state.minus(prior.state), shared.minus(prior.common);
    const Vec18 slope = prior.information * d + prior.gradient;
    g.head<9>() += slope.head<9>();
    g.tail<9>() += slope.tail<9>();
    H.topLeftCorner<9, 9>() += prior.information.topLeftCorner<9, 9>();
    H.topRightCorner<9, 9>() += prior.information.topRightCorner<9, 9>();
    H.bottomLeftCorner<9, 9>() += prior.information.bottomLeftCorner<9, 9>();
    H.bottomRightCorner<9, 9>() += prior.information.bottomRightCorner<9, 9>();
  }

  Eigen::Index common;  ///< row of the common parameters
  MatX H;
  VecX g;
};

InertialWindow::Equations InertialWindow::linearise(std::size_t frames) const {
  Equations equations(frames);
  equations.add(prior_, frames_.front().state, common_);
  for (std::size_t k = 0; k < frames; ++k) {
    const auto row = static_cast<Eigen::Index>(9 * k);
    if (k == 0 || frames == frames_.size()) equations.add(frames_[k], row);
    if (k + 1 == frames) break;
    const auto readings = between(frames_[k], frames_[k + 1].stamp);
    if (!readings) continue;
    equations.add(inertial_residual(frames_[k].state, frames_[k + 1].state, common_, *readings),
                  inverse_of_symmetric(inertial_covariance(*readings)), row);
  }
  return equations;
}

void InertialWindow::solve() {
  for (int iteration = 0; iteration < kWindowIterations; ++iteration) {
    const Equations equations = linearise(frames_.size());
    const VecX step = symmetric_solution(equations.H, -equations.g).x;
    if (!step.allFinite()) return;
    for (std::size_t k = 0; k < frames_.size(); ++k)
      frames_[k].state = frames_[k].state.moved(step.segment<9>(static_cast<Eigen::Index>(9 * k)));
    common_ = common_.moved(step.tail<9>());
    common_.delay_s = std::clamp(common_.delay_s, -kMaxDelay_s, kMaxDelay_s);
    if (step.lpNorm<Eigen::Infinity>() < kWindowConverged) break;
  }
  const Equations equations = linearise(frames_.size());
  MatX chosen = MatX::Zero(equations.H.rows(), 18);
  chosen.bottomRows<18>().setIdentity();
  covariance_ = symmetric_solutions(equations.H, chosen).bottomRows<18>();
  covariance_ = (0.5 * (covariance_ + covariance_.transpose())).eval();
}

void InertialWindow::marginalise_first() {
  const Equations equations = linearise(2);
  const MatX gain =
      equations.H.bottomLeftCorner<18, 9>() * inverse_of_symmetric(equations.H.topLeftCorner<9, 9>());
  const MatX information =
      equations.H.bottomRightCorner<18, 18>() - gain * equations.H.topRightCorner<9, 18>();
  const Vec18 gradient = equations.g.tail<18>() - gain * equations.g.head<9>();
  Mat18 covariance = inverse_of_symmetric(information);
  const Vec18 mean = -covariance * gradient;
  const double passed_s = (frames_[1].stamp - frames_[0].stamp).seconds();
  covariance.bottomRightCorner<9, 9>() +=
      passed_s * common_covariance(kGyroBiasWalk, kAccelBiasWalk, kTiltWalk_rad, kDelayWalk_s);
  frames_.pop_front();
  prior_.state = frames_.front().state;
  prior_.common = common_;
  prior_.information = inverse_of_symmetric(covariance);
  prior_.gradient = -prior_.information * mean;
}

Mat9 InertialWindow::known_common_information() const {
  if (!knows_gravity_ || frames_.empty()) return first_information();
  return inverse_of_symmetric(covariance_.bottomRightCorner<9, 9>());
}

}  // namespace hm
