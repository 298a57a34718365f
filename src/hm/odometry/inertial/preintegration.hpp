#pragma once
#include <optional>
#include <span>

#include "hm/sensors/imu.hpp"

namespace hm {

using Vec9 = Eigen::Matrix<double, 9, 1>;
using Mat9 = Eigen::Matrix<double, 9, 9>;

/// White noise of an IMU's readings. The defaults are 2.5 times the data sheet values of a telephone's
/// (Bosch BMI055): its readings also alias vibrations.
struct ImuNoise {
  double gyro_rad_s_sqrt_hz = 5e-4;
  double accel_m_s2_sqrt_hz = 5e-3;
};

/// Biases of the readings; camera frame.
struct ImuBias {
  Vec3 gyro_rad_s = Vec3::Zero();
  Vec3 accel_m_s2 = Vec3::Zero();

  template <class Archive>
  void visit_state(Archive& archive) {
    archive(gyro_rad_s, accel_m_s2);
  }
};

/// Motion between two times from the readings alone, in the camera's frame at the first (Forster et al.
/// 2017, "On-Manifold Preintegration", equations 33 to 38, 44, 62, 63): independent of pose, velocity and
/// gravity there.
struct Preintegration {
  double duration_s = 0;
  Mat3 dR = Mat3::Identity();  ///< rotation: R_begin_end
  Vec3 dv = Vec3::Zero();      ///< integral of the rotated specific force, m/s
  Vec3 dp = Vec3::Zero();      ///< double integral of it, m
  /// Covariance of [rotation; velocity; position], rotation as dR exp(.).
  Mat9 covariance = Mat9::Zero();
  /// Derivatives by the biases: dR exp(R_by_gyro b), dv + v_by_gyro b_g + v_by_accel b_a, dp likewise.
  Mat3 R_by_gyro = Mat3::Zero();
  Mat3 v_by_gyro = Mat3::Zero(), v_by_accel = Mat3::Zero();
  Mat3 p_by_gyro = Mat3::Zero(), p_by_accel = Mat3::Zero();
  /// Derivative of [rotation; velocity; position] by a shift of both times, per second.
  Vec9 by_delay = Vec9::Zero();
};

/// Integrates from `begin` to `end`, readings (camera frame, increasing stamps) interpolated linearly.
/// `delay_s`: stamps of readings are later by this than the camera's clock. Empty when readings are further
/// apart than 0.1 s, or from both ends, or when the times do not increase.
std::optional<Preintegration> preintegrate(std::span<const ImuSample> readings, Time begin, Time end,
                                           double delay_s, const ImuBias& bias, const ImuNoise& noise);

/// Right Jacobian of SO(3): exp(r + d) = exp(r) exp(J d) to first order.
Mat3 right_jacobian(const Vec3& rotation_vector);

}  // namespace hm
