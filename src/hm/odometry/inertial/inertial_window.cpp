// hm: compiled alone, as it takes as long as a unit of many files
#include "hm/odometry/inertial/inertial_window.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "hm/geometry/solvers/large_solvers.hpp"
#include "hm/geometry/solvers/small_solvers.hpp"

namespace hm {
namespace {

constexpr std::size_t kFrames = 8;
constexpr std::size_t kMaxReadings = 8000;  // 20 s and more, when no frame gets a pose
constexpr double kVelocitySigma_m_s = 3;    // before the first frame
constexpr double kMargin_s = 2;             // of readings before the first frame

/// Turns position and velocity of a state's perturbation.
Mat18 turned(const Mat18& A, const Mat3& R) {
  Mat18 P = Mat18::Identity();
  P.block<3, 3>(0, 0) = R;
  P.block<3, 3>(6, 6) = R;
  return P * A * P.transpose();
}

}  // namespace

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
  const Mat9 back = inverse_of(residual.by_second);
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

void InertialWindow::find_gravity(const Frame& first, const Preintegration& readings) {
  const Vec3 up = first.state.T_odom_camera.rotation() * readings.dv;
  common_.R_odom_level = turn_between(Vec3::UnitZ(), up).toRotationMatrix();
  prior_.common.R_odom_level = common_.R_odom_level;
  knows_gravity_ = true;
}

void InertialWindow::drop_old_readings() {
  const Time keep = frames_.front().stamp - Duration::from_seconds(kMargin_s);
  const auto first = std::find_if(readings_.begin(), readings_.end(),
                                  [&](const ImuSample& reading) { return !(reading.stamp < keep); });
  readings_.erase(readings_.begin(), first);
}

}  // namespace hm
