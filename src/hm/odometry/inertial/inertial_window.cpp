#include "hm/odometry/inertial/inertial_window.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

#include "hm/geometry/solvers/small_solvers.hpp"

namespace hm {
namespace {

using MatX = Eigen::MatrixXd;
using VecX = Eigen::VectorXd;

constexpr std::size_t kFrames = 8;
constexpr std::size_t kMaxReadings = 8000;  // 20 s and more, when no frame gets a pose
constexpr int kIterations = 4;
constexpr double kConverged = 1e-6;
constexpr double kMaxDelay_s = 0.05;
constexpr double kMargin_s = 2;                // of readings before the first frame
constexpr double kSquaredMahalanobis = 16.81;  // chi-squared, six degrees of freedom, 99 %
constexpr double kLeastVisualInformation = 1;  // 1/m^2, 1/rad^2

// What is known before the first frame: biases of telephones, gravity from the first mean force (the camera
// may accelerate), delay.
constexpr double kVelocitySigma_m_s = 3, kGyroBiasSigma_rad_s = 0.02, kAccelBiasSigma_m_s2 = 0.3;
constexpr double kTiltSigma_rad = 0.5, kDelaySigma_s = 0.02;
// Random walks, per root of a second. That of the tilt is the drift of the visual poses.
constexpr double kGyroBiasWalk = 1e-4, kAccelBiasWalk = 3e-3, kTiltWalk_rad = 1e-3, kDelayWalk_s = 1e-4;
// Of rotation, velocity and position over an interval besides the noise: interpolation, jitter of stamps.
constexpr double kTurnFloor_rad = 2e-4, kVelocityFloor_m_s = 2e-3, kPositionFloor_m = 2e-4;

Mat9 common_covariance(double gyro, double accel, double tilt, double delay) {
  Vec9 sigma;
  sigma << Vec3::Constant(gyro), Vec3::Constant(accel), tilt, tilt, delay;
  return sigma.cwiseAbs2().asDiagonal();
}

Mat9 first_information() {
  return common_covariance(1 / kGyroBiasSigma_rad_s, 1 / kAccelBiasSigma_m_s2, 1 / kTiltSigma_rad,
                           1 / kDelaySigma_s);
}

Mat9 inertial_covariance(const Preintegration& between) {
  Vec9 floor;
  floor << Vec3::Constant(kTurnFloor_rad), Vec3::Constant(kVelocityFloor_m_s),
      Vec3::Constant(kPositionFloor_m);
  Mat9 covariance = between.covariance;
  covariance.diagonal() += floor.cwiseAbs2();
  return covariance;
}

/// Inverse for any size, so that the solver is compiled once.
MatX inverse_of_symmetric(const MatX& A) {
  const MatX inverse = Eigen::LDLT<MatX>(A).solve(MatX::Identity(A.rows(), A.cols()));
  return 0.5 * (inverse + inverse.transpose());
}

/// Turns position and velocity of a state's perturbation.
Mat18 turned(const Mat18& A, const Mat3& R) {
  Mat18 P = Mat18::Identity();
  P.block<3, 3>(0, 0) = R;
  P.block<3, 3>(6, 6) = R;
  return P * A * P.transpose();
}

Mat6 pose_by_state(const Mat3& R_odom_camera) {
  Mat6 J = Mat6::Identity();
  J.topLeftCorner<3, 3>() = R_odom_camera.transpose();
  return J;
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

Mat6 InertialPrediction::pose_covariance() const {
  const Mat6 J = pose_by_state(state.T_odom_camera.rotation());
  return J * covariance.topLeftCorner<6, 6>() * J.transpose();
}

void InertialWindow::feed(std::span<const ImuSample> readings) {
  for (const ImuSample& reading : readings)
    if (readings_.empty() || reading.stamp > readings_.back().stamp) {
      readings_.push_back(reading);
      readings_.back().R_world_imu.reset();
    }
  if (readings_.size() > kMaxReadings)
    readings_.erase(readings_.begin(), readings_.end() - static_cast<std::ptrdiff_t>(kMaxReadings / 2));
}

std::size_t InertialWindow::memory_bytes() const {
  return readings_.capacity() * sizeof(ImuSample) + frames_.size() * sizeof(Frame);
}

void InertialWindow::add(Time stamp, const VisualPose& pose) {
  if (frames_.empty()) return continue_from(stamp, pose, nullptr);
  const auto readings = between(frames_.back(), stamp);
  if (!readings) return continue_from(stamp, pose, nullptr);
  if (!knows_gravity_) find_gravity(frames_.back(), *readings);
  InertialState state = propagated(frames_.back().state, common_, *readings);
  if (frames_.size() == 1 && !(prior_.information(6, 6) > 1)) {  // the velocity is not known yet
    frames_.back().state.velocity_m_s =
        (pose.T_odom_camera.translation() - frames_.back().pose.T_odom_camera.translation()) /
        readings->duration_s;
    state.velocity_m_s = frames_.back().state.velocity_m_s;
  }
  state.T_odom_camera = pose.T_odom_camera;
  frames_.push_back({stamp, state, pose});
  solve();
  if (frames_.size() > kFrames) marginalise_first();
  drop_old_readings();
}

std::optional<InertialPrediction> InertialWindow::predict(Time stamp) const {
  if (frames_.empty() || (frames_.size() < 2 && !(prior_.information(6, 6) > 1))) return std::nullopt;
  const auto readings = between(frames_.back(), stamp);
  if (!readings) return std::nullopt;
  InertialPrediction out;
  out.stamp = stamp;
  out.state = propagated(frames_.back().state, common_, *readings);
  const InertialResidual residual = inertial_residual(frames_.back().state, out.state, common_, *readings);
  const Mat9 back = residual.by_second.inverse();
  Mat18 F = Mat18::Identity();
  F.topLeftCorner<9, 9>() = -back * residual.by_first;
  F.topRightCorner<9, 9>() = -back * residual.by_common;
  out.covariance = F * covariance_ * F.transpose();
  out.covariance.topLeftCorner<9, 9>() += back * inertial_covariance(*readings) * back.transpose();
  return out;
}

std::optional<GyroTurn> InertialWindow::turn(Time begin, Time end) const {
  const auto readings = preintegrate(readings_, begin, end, common_.delay_s, common_.bias, {});
  if (!readings) return std::nullopt;
  Eigen::Matrix<double, 3, 4> by_common;  // gyroscope's bias, delay
  by_common << readings->R_by_gyro, readings->by_delay.head<3>();
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
  covariance.topLeftCorner<3, 3>() = covariance_.block<3, 3>(9, 9);
  covariance(3, 3) = covariance_(17, 17);
  const Mat3 floor = kTurnFloor_rad * kTurnFloor_rad * Mat3::Identity();
  return GyroTurn{readings->dR, readings->covariance.topLeftCorner<3, 3>() + floor +
                                    by_common * covariance * by_common.transpose()};
}

void InertialWindow::continue_from(Time stamp, const VisualPose& pose, const InertialPrediction* prediction) {
  Prior prior;
  prior.state.T_odom_camera = pose.T_odom_camera;
  prior.common = common_;
  Mat18 covariance = Mat18::Zero();
  if (prediction != nullptr) {
    prior.state.velocity_m_s = prediction->state.velocity_m_s;
    covariance = prediction->covariance;
  } else {
    covariance.block<3, 3>(6, 6) = kVelocitySigma_m_s * kVelocitySigma_m_s * Mat3::Identity();
    covariance.bottomRightCorner<9, 9>() = inverse_of_symmetric(known_common_information());
  }
  prior.information.bottomRightCorner<12, 12>() =
      inverse_of_symmetric(covariance.bottomRightCorner<12, 12>());
  prior_ = prior;
  frames_.clear();
  frames_.push_back({stamp, prior.state, pose});
  solve();
  drop_old_readings();
}

void InertialWindow::forget() {
  frames_.clear();
  common_ = {};
  knows_gravity_ = false;
}

void InertialWindow::move(const SE3& motion) {
  const SE3 T_new_old(motion.quaternion(), motion.translation());  // exactly orthonormal
  const Mat3& R = T_new_old.rotation();
  const auto moved = [&](InertialState& state) {
    state.T_odom_camera = T_new_old * state.T_odom_camera;
    state = state.moved(Vec9::Zero());
    state.velocity_m_s = R * state.velocity_m_s;
  };
  for (Frame& frame : frames_) {
    moved(frame.state);
    frame.pose.T_odom_camera = T_new_old * frame.pose.T_odom_camera;
  }
  moved(prior_.state);
  common_.R_odom_level = R * common_.R_odom_level;
  common_ = common_.moved(Vec9::Zero());
  prior_.common.R_odom_level = R * prior_.common.R_odom_level;
  prior_.information = turned(prior_.information, R);
  prior_.gradient.head<3>() = R * prior_.gradient.head<3>();
  prior_.gradient.segment<3>(6) = R * prior_.gradient.segment<3>(6);
  covariance_ = turned(covariance_, R);
}

std::optional<Preintegration> InertialWindow::between(const Frame& first, Time end) const {
  return preintegrate(readings_, first.stamp, end, common_.delay_s, common_.bias, {});
}

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

void InertialWindow::find_gravity(const Frame& first, const Preintegration& readings) {
  const Vec3 up = first.state.T_odom_camera.rotation() * readings.dv;
  common_.R_odom_level = turn_between(Vec3::UnitZ(), up).toRotationMatrix();
  prior_.common.R_odom_level = common_.R_odom_level;
  knows_gravity_ = true;
}

void InertialWindow::solve() {
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    const Equations equations = linearise(frames_.size());
    const Eigen::LDLT<MatX> factors(equations.H);
    const VecX step = factors.solve(-equations.g);
    if (!step.allFinite()) return;
    for (std::size_t k = 0; k < frames_.size(); ++k)
      frames_[k].state = frames_[k].state.moved(step.segment<9>(static_cast<Eigen::Index>(9 * k)));
    common_ = common_.moved(step.tail<9>());
    common_.delay_s = std::clamp(common_.delay_s, -kMaxDelay_s, kMaxDelay_s);
    if (step.lpNorm<Eigen::Infinity>() < kConverged) break;
  }
  const Equations equations = linearise(frames_.size());
  MatX chosen = MatX::Zero(equations.H.rows(), 18);
  chosen.bottomRows<18>().setIdentity();
  covariance_ = Eigen::LDLT<MatX>(equations.H).solve(chosen).bottomRows<18>();
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

void InertialWindow::drop_old_readings() {
  const Time keep = frames_.front().stamp - Duration::from_seconds(kMargin_s);
  const auto first = std::find_if(readings_.begin(), readings_.end(),
                                  [&](const ImuSample& reading) { return !(reading.stamp < keep); });
  readings_.erase(readings_.begin(), first);
}

Mat9 InertialWindow::known_common_information() const {
  if (!knows_gravity_ || frames_.empty()) return first_information();
  return inverse_of_symmetric(covariance_.bottomRightCorner<9, 9>());
}

}  // namespace hm
