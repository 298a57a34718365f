#include "hm/odometry/inertial/inertial_factors.hpp"

namespace hm {
namespace {

// As kTurnFloor_rad.
constexpr double kVelocityFloor_m_s = 2e-3, kPositionFloor_m = 2e-4;

/// Products of rotations lose their orthonormality, which predictions and registrations would amplify in
/// turn.
Mat3 orthonormal(const Mat3& R) { return Eigen::Quaterniond(R).normalized().toRotationMatrix(); }

Mat3 inverse_right_jacobian(const Vec3& r) { return right_jacobian(r).inverse(); }

}  // namespace

InertialState InertialState::moved(const Vec9& by) const {
  return {SE3(orthonormal(T_odom_camera.rotation() * so3_exp(by.segment<3>(3))),
              T_odom_camera.translation() + by.head<3>()),
          velocity_m_s + by.tail<3>()};
}

Vec9 InertialState::minus(const InertialState& other) const {
  Vec9 out;
  out << T_odom_camera.translation() - other.T_odom_camera.translation(),
      so3_log(other.T_odom_camera.rotation().transpose() * T_odom_camera.rotation()),
      velocity_m_s - other.velocity_m_s;
  return out;
}

InertialCommon InertialCommon::moved(const Vec9& by) const {
  return {{bias.gyro_rad_s + by.head<3>(), bias.accel_m_s2 + by.segment<3>(3)},
          orthonormal(R_odom_level * so3_exp({by[6], by[7], 0})),
          delay_s + by[8]};
}

Vec9 InertialCommon::minus(const InertialCommon& other) const {
  Vec9 out;
  out << bias.gyro_rad_s - other.bias.gyro_rad_s, bias.accel_m_s2 - other.bias.accel_m_s2,
      so3_log(other.R_odom_level.transpose() * R_odom_level).head<2>(), delay_s - other.delay_s;
  return out;
}

InertialResidual inertial_residual(const InertialState& first, const InertialState& second,
                                   const InertialCommon& common, const Preintegration& between) {
  const double dt = between.duration_s;
  const Mat3 &R1 = first.T_odom_camera.rotation(), &R2 = second.T_odom_camera.rotation();
  const Mat3 back = R1.transpose();
  const Vec3 g = common.gravity_odom_m_s2();
  const Vec3 change = back * (second.velocity_m_s - first.velocity_m_s - g * dt);
  const Vec3 path = back * (second.T_odom_camera.translation() - first.T_odom_camera.translation() -
                            first.velocity_m_s * dt - 0.5 * dt * dt * g);
  InertialResidual out;
  const Vec3 turn = so3_log(between.dR.transpose() * back * R2);
  out.value << turn, change - between.dv, path - between.dp;
  const Mat3 J = inverse_right_jacobian(turn);
  const Mat3 to_end = so3_exp(turn).transpose();

  out.by_first.setZero();
  out.by_first.block<3, 3>(0, 3) = -J * R2.transpose() * R1;
  out.by_first.block<3, 3>(3, 3) = skew(change);
  out.by_first.block<3, 3>(3, 6) = -back;
  out.by_first.block<3, 3>(6, 0) = -back;
  out.by_first.block<3, 3>(6, 3) = skew(path);
  out.by_first.block<3, 3>(6, 6) = -dt * back;

  out.by_second.setZero();
  out.by_second.block<3, 3>(0, 3) = J;
  out.by_second.block<3, 3>(3, 6) = back;
  out.by_second.block<3, 3>(6, 0) = back;

  out.by_common.setZero();
  out.by_common.block<3, 3>(0, 0) = -J * to_end * between.R_by_gyro;
  out.by_common.block<3, 3>(3, 0) = -between.v_by_gyro;
  out.by_common.block<3, 3>(3, 3) = -between.v_by_accel;
  out.by_common.block<3, 3>(6, 0) = -between.p_by_gyro;
  out.by_common.block<3, 3>(6, 3) = -between.p_by_accel;
  // g = -|g| R_level exp(tilt) e_z
  const Mat3 g_by_tilt = kGravity_m_s2 * common.R_odom_level * skew(Vec3::UnitZ());
  out.by_common.block<3, 2>(3, 6) = (-dt * back * g_by_tilt).leftCols<2>();
  out.by_common.block<3, 2>(6, 6) = (-0.5 * dt * dt * back * g_by_tilt).leftCols<2>();
  out.by_common.col(8) = -between.by_delay;
  out.by_common.block<3, 1>(0, 8) = -J * to_end * between.by_delay.head<3>();
  return out;
}

InertialState propagated(const InertialState& first, const InertialCommon& common,
                         const Preintegration& between) {
  const double dt = between.duration_s;
  const Mat3& R = first.T_odom_camera.rotation();
  const Vec3 g = common.gravity_odom_m_s2();
  return {SE3(orthonormal(R * between.dR), first.T_odom_camera.translation() + first.velocity_m_s * dt +
                                               0.5 * dt * dt * g + R * between.dp),
          first.velocity_m_s + g * dt + R * between.dv};
}

Mat9 inertial_covariance(const Preintegration& between) {
  Vec9 floor;
  floor << Vec3::Constant(kTurnFloor_rad), Vec3::Constant(kVelocityFloor_m_s),
      Vec3::Constant(kPositionFloor_m);
  Mat9 covariance = between.covariance;
  covariance.diagonal() += floor.cwiseAbs2();
  return covariance;
}

Mat6 pose_by_state(const Mat3& R_odom_camera) {
  Mat6 J = Mat6::Identity();
  J.topLeftCorner<3, 3>() = R_odom_camera.transpose();
  return J;
}

}  // namespace hm
