#include "hm/odometry/tracker/gravity_estimator.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "hm/geometry/solvers/small_solvers.hpp"
#include "hm/sensors/imu.hpp"

namespace hm {
namespace {

constexpr double kStretch_s = 1.5;
constexpr double kVelocitySpan_s = 0.1;      // over which the path's velocity is taken at both ends
constexpr double kMaxFrameGap_s = 0.5;       // between frames
constexpr double kSigma_m_s2 = 0.12;         // of a stretch: velocities by vision, noise, timing
constexpr double kBiasSigma_m_s2 = 0.3;      // of consumer devices
constexpr double kNormTolerance_m_s2 = 0.7;  // bias and scale of consumer devices

Eigen::Matrix<double, 3, 6> by_state(const Mat3& mean_rotation) {
  Eigen::Matrix<double, 3, 6> H;
  H << Mat3::Identity(), mean_rotation;
  return H;
}

}  // namespace

std::optional<GravityEstimator::Stretch> GravityEstimator::stretch_of(const std::deque<Sample>& path) {
  if (path.size() < 4) return std::nullopt;
  const auto at = [&](std::size_t i) { return (path[i].stamp - path.front().stamp).seconds(); };
  const std::size_t last = path.size() - 1;
  if (at(last) < 0.9 * kStretch_s) return std::nullopt;
  std::size_t first_end = 1, last_begin = last - 1;
  while (first_end < last && at(first_end) < kVelocitySpan_s) ++first_end;
  while (last_begin > 0 && at(last) - at(last_begin) < kVelocitySpan_s) --last_begin;
  const double rise_s = at(first_end), fall_s = at(last) - at(last_begin);
  const auto& T = [&](std::size_t i) -> const SE3& { return path[i].T_odom_camera; };
  const Vec3 first_velocity = (T(first_end).translation() - T(0).translation()) / rise_s;
  const Vec3 last_velocity = (T(last).translation() - T(last_begin).translation()) / fall_s;
  // The difference of two mean velocities is the integral of the acceleration under a trapezium.
  Stretch out;
  out.rotation.setZero();
  double weights = 0;
  for (std::size_t i = 1; i <= last; ++i) {
    const double middle = 0.5 * (at(i - 1) + at(i));
    const double height = std::min({1.0, middle / rise_s, (at(last) - middle) / fall_s});
    const double weight = height * (at(i) - at(i - 1));
    const Mat3 rotation = 0.5 * (T(i - 1).rotation() + T(i).rotation());
    out.mean += weight * (rotation * path[i].force_camera);
    out.rotation += weight * rotation;
    weights += weight;
  }
  out.mean = (out.mean - (last_velocity - first_velocity)) / weights;
  out.rotation /= weights;
  out.duration_s = at(last);
  return out;
}

double GravityEstimator::squared_mahalanobis(const Stretch& stretch) const {
  const auto H = by_state(stretch.rotation);
  const Vec3 innovation = stretch.mean - H * state_;
  const Mat3 S = H * covariance_ * H.transpose() + kSigma_m_s2 * kSigma_m_s2 * Mat3::Identity();
  return innovation.dot(solve_symmetric_3(S, innovation));
}

bool GravityEstimator::plausible(const Stretch& stretch) const {
  if (std::abs(stretch.mean.norm() - kGravity_m_s2) > kNormTolerance_m_s2) return false;
  return !known_ || squared_mahalanobis(stretch) < kOutlierSquaredMahalanobis;
}

void GravityEstimator::update(const Stretch& stretch) {
  if (!known_) {
    known_ = true;
    state_.head<3>() = stretch.mean;
    covariance_.setZero();
    covariance_.topLeftCorner<3, 3>() = Mat3::Identity();
    covariance_.bottomRightCorner<3, 3>() = kBiasSigma_m_s2 * kBiasSigma_m_s2 * Mat3::Identity();
  }
  const auto H = by_state(stretch.rotation);
  const Mat3 R = kSigma_m_s2 * kSigma_m_s2 * Mat3::Identity();
  const Mat3 S = H * covariance_ * H.transpose() + R;
  const Eigen::Matrix<double, 6, 3> K = covariance_ * H.transpose() * S.inverse();
  state_ += K * (stretch.mean - H * state_);
  const Mat6 keep = Mat6::Identity() - K * H;
  covariance_ = (keep * covariance_ * keep.transpose() + K * R * K.transpose()).eval();
}

void GravityEstimator::add(Time stamp, const SE3& T_odom_camera, const Vec3& force_camera_m_s2) {
  if (!path_.empty() && (stamp - path_.back().stamp).seconds() > kMaxFrameGap_s) path_.clear();
  path_.push_back({stamp, T_odom_camera, force_camera_m_s2});
  while ((stamp - path_[0].stamp).seconds() > kStretch_s && path_.size() > 4) path_.pop_front();
  if (known_ && (stamp - updated_).seconds() < kStretch_s) return;
  const auto stretch = stretch_of(path_);
  if (!stretch || !plausible(*stretch)) return;
  update(*stretch);
  updated_ = stamp;
}

void GravityEstimator::reset() { *this = {}; }

GravityEstimator::Answer GravityEstimator::observe(Time stamp, const SE3& T_odom_camera_guess,
                                                   const Vec3& force_camera_m_s2) const {
  if (!known_ || path_.empty()) return {};
  std::deque<Sample> path = path_;
  path.push_back({stamp, T_odom_camera_guess, force_camera_m_s2});
  const auto stretch = stretch_of(path);
  if (!stretch) return {};
  if (!plausible(*stretch)) return {Verdict::kRejected, {}};
  Answer answer{Verdict::kUsed, {}};
  const Vec3 seen = stretch->mean - stretch->rotation * bias_camera_m_s2();
  answer.up.up_odom = gravity_odom_m_s2().normalized();
  answer.up.up_camera = T_odom_camera_guess.rotation().transpose() * seen.normalized();
  answer.up.sigma_rad = std::abs(seen.norm() - gravity_odom_m_s2().norm()) / kGravity_m_s2;
  return answer;
}

}  // namespace hm
