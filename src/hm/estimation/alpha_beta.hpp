#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "hm/core/param_doc.hpp"
#include "hm/core/time.hpp"
#include "hm/estimation/filter_math.hpp"

namespace hm {

/// Gains of an alpha-beta filter, dissertation 2.2.4; the defaults are for poses (heights: 0.9, 0.9).
template <class Scalar>
struct BasicAlphaBetaParams {
  /// Share of the residual added to the estimate; smaller is smoother, with more lag.
  Scalar alpha_ratio = Scalar(0.9);
  /// Share of the residual added to the velocity; smaller is smoother, with more lag.
  Scalar beta_ratio = Scalar(0.5);
  Scalar max_gap_s = Scalar(0.5);  ///< the filter restarts after a longer gap between samples
};
using AlphaBetaParams = BasicAlphaBetaParams<double>;

enum class AlphaBetaStatus {
  kFirst,          ///< first sample: position as measured, velocity zero
  kUpdated,        ///< predicted and corrected
  kRestarted,      ///< after a gap beyond max_gap_s: as for the first sample
  kTimeBackwards,  ///< not later than the previous sample (including dt = 0): ignored
  kInvalid,        ///< not a number: ignored
};

namespace detail {
/// Classifies a sample by its time.
template <class Scalar>
AlphaBetaStatus alpha_beta_step(bool started, Duration since_last, Scalar max_gap_s) {
  if (!started) return AlphaBetaStatus::kFirst;
  if (since_last.ns <= 0) return AlphaBetaStatus::kTimeBackwards;
  return seconds_of<Scalar>(since_last) > max_gap_s ? AlphaBetaStatus::kRestarted : AlphaBetaStatus::kUpdated;
}
}  // namespace detail

/// Alpha-beta filter of an N-vector with common gains (dissertation 2.2.4, eqs 2.4-2.8): position and
/// velocity from position measurements. Starts with velocity zero.
template <int N, class Scalar = double>
class AlphaBetaFilter {
 public:
  using Vector = FilterVector<Scalar, N>;
  using Params = BasicAlphaBetaParams<Scalar>;
  explicit AlphaBetaFilter(const Params& params = {}) : params_(params) {}

  AlphaBetaStatus update(Time time, const Vector& measured) {
    if (!measured.allFinite()) return AlphaBetaStatus::kInvalid;
    const Duration since_last = time - time_;
    const auto status = detail::alpha_beta_step(started_, since_last, params_.max_gap_s);
    if (status == AlphaBetaStatus::kTimeBackwards) return status;
    time_ = time;
    started_ = true;
    if (status != AlphaBetaStatus::kUpdated) {
      position_ = measured;
      velocity_.setZero();
      return status;
    }
    const Scalar dt_s = seconds_of<Scalar>(since_last);
    position_ += dt_s * velocity_;                        // (2.4); the velocity stays (2.5)
    const Vector residual = measured - position_;         // (2.6)
    position_ += params_.alpha_ratio * residual;          // (2.7)
    velocity_ += (params_.beta_ratio / dt_s) * residual;  // (2.8)
    return status;
  }

  [[nodiscard]] Time time() const { return time_; }
  [[nodiscard]] const Vector& position() const { return position_; }
  [[nodiscard]] const Vector& velocity() const { return velocity_; }  ///< units of position per second
  /// Predicted position (eq. 2.4); does not change the filter.
  [[nodiscard]] Vector predicted(Time time) const {
    return position_ + seconds_of<Scalar>(time - time_) * velocity_;
  }

 private:
  Params params_;
  Time time_;
  bool started_ = false;
  Vector position_ = Vector::Zero(), velocity_ = Vector::Zero();
};

using AlphaBetaHeight = AlphaBetaFilter<1>;
using AlphaBetaPosition = AlphaBetaFilter<3>;

/// Alpha-beta filter of an angle that wraps (yaw); the estimate stays in (-pi, pi].
template <class Scalar>
class BasicAlphaBetaAngle {
 public:
  using Params = BasicAlphaBetaParams<Scalar>;
  explicit BasicAlphaBetaAngle(const Params& params = {}) : params_(params) {}
  AlphaBetaStatus update(Time time, Scalar measured_rad);
  [[nodiscard]] Scalar angle_rad() const { return angle_rad_; }
  [[nodiscard]] Scalar rate_rad_s() const { return rate_rad_s_; }

 private:
  Params params_;
  Time time_;
  bool started_ = false;
  Scalar angle_rad_ = 0, rate_rad_s_ = 0;
};
using AlphaBetaAngle = BasicAlphaBetaAngle<double>;

/// Alpha-beta filter of an orientation: the steps of eqs 2.4-2.8 with the rotation vector of predicted^-1 *
/// measured as residual, so that the correction is slerp(predicted, measured, alpha). For rotation about a
/// fixed axis the rate is the blend (1 - beta) rate + beta (measured change / dt).
class AlphaBetaOrientation {
 public:
  explicit AlphaBetaOrientation(const AlphaBetaParams& params = {}) : params_(params) {}
  /// Updates with a quaternion of any sign and non-zero length.
  AlphaBetaStatus update(Time time, const Eigen::Quaterniond& measured_R_world_body);
  [[nodiscard]] const Eigen::Quaterniond& R_world_body() const { return R_world_body_; }
  [[nodiscard]] const Eigen::Vector3d& rate_body_rad_s() const { return rate_body_rad_s_; }

 private:
  AlphaBetaParams params_;
  Time time_;
  bool started_ = false;
  Eigen::Quaterniond R_world_body_ = Eigen::Quaterniond::Identity();
  Eigen::Vector3d rate_body_rad_s_ = Eigen::Vector3d::Zero();
};

/// Shortest rotation vector of a unit quaternion, radians, of length at most pi.
Eigen::Vector3d rotation_vector(const Eigen::Quaterniond& rotation);

}  // namespace hm
