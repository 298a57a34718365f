#pragma once
#include "hm/odometry/inertial/preintegration.hpp"

namespace hm {

/// Motion of the camera at a frame. Perturbation of nine: p + [0:3], R exp([3:6]), v + [6:9].
struct InertialState {
  SE3 T_odom_camera;
  Vec3 velocity_m_s = Vec3::Zero();  ///< in odom

  [[nodiscard]] InertialState moved(const Vec9& by) const;
  /// The perturbation that leads here from `other`.
  [[nodiscard]] Vec9 minus(const InertialState& other) const;
  template <class Archive>
  void visit_state(Archive& archive) {
    archive(T_odom_camera, velocity_m_s);
  }
};

/// Variables that all frames of a window share. Perturbation of nine: biases of gyroscope [0:3] and
/// accelerometer [3:6], tilt of gravity about two level axes [6:8], delay [8].
struct InertialCommon {
  ImuBias bias;
  Mat3 R_odom_level = Mat3::Identity();  ///< z points up
  double delay_s = 0;                    ///< stamps of readings are later by this than the camera's clock

  [[nodiscard]] Vec3 gravity_odom_m_s2() const { return -kGravity_m_s2 * R_odom_level.col(2); }
  [[nodiscard]] InertialCommon moved(const Vec9& by) const;
  [[nodiscard]] Vec9 minus(const InertialCommon& other) const;
  template <class Archive>
  void visit_state(Archive& archive) {
    archive(bias, R_odom_level, delay_s);
    if constexpr (Archive::kReads) archive.require(is_rigid(SE3(R_odom_level, Vec3::Zero())));
  }
};

/// Residual of two frames and the readings between them: rotation, velocity, position (Forster et al. 2017,
/// equation 45), with its derivatives.
struct InertialResidual {
  Vec9 value;
  Mat9 by_first, by_second, by_common;
};

/// `between` was integrated with the biases and the delay of `common`, so that no first-order correction is
/// needed.
InertialResidual inertial_residual(const InertialState& first, const InertialState& second,
                                   const InertialCommon& common, const Preintegration& between);

/// Standard deviation of the rotation over an interval besides the noise of the readings, rad: interpolation,
/// jitter of stamps.
inline constexpr double kTurnFloor_rad = 2e-4;
/// Covariance of the residual's value: noise of the readings, and the same for rotation, velocity, position.
Mat9 inertial_covariance(const Preintegration& between);

/// Derivative of a pose's perturbation (T exp([translation; rotation])) by that of a state ([0:6]).
Mat6 pose_by_state(const Mat3& R_odom_camera);

/// State after the readings: where the residual is zero.
InertialState propagated(const InertialState& first, const InertialCommon& common,
                         const Preintegration& between);

}  // namespace hm
