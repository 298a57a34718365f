#include "hm/link/link_frames.hpp"

#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>

#include "hm/geometry/se2.hpp"

namespace hm {
namespace {

/// Rotation from our world to theirs; symmetric, thus its own inverse.
Mat3 world_swap_matrix(AutopilotWorld world) {
  Mat3 R;
  if (world == AutopilotWorld::kNed)
    R << 0, 1, 0, 1, 0, 0, 0, 0, -1;
  else
    R << 1, 0, 0, 0, -1, 0, 0, 0, -1;
  return R;
}

Mat6 swap_both_parts(const Mat6& covariance, const Mat3& R) {
  Mat6 both = Mat6::Zero();
  both.topLeftCorner<3, 3>() = R;
  both.bottomRightCorner<3, 3>() = R;
  return both * covariance * both.transpose();
}

}  // namespace

Vec3 swap_world(const Vec3& vector, AutopilotWorld world) { return world_swap_matrix(world) * vector; }

Vec3 swap_body(const Vec3& vector) { return {vector.x(), -vector.y(), -vector.z()}; }

Eigen::Quaterniond swap_orientation(const Eigen::Quaterniond& q, AutopilotWorld world) {
  // R' = S R F, with S the swap of the world and F that of the body.
  const Eigen::Quaterniond S(world_swap_matrix(world)), F(0, 1, 0, 0);
  Eigen::Quaterniond result = (S * q * F).normalized();
  if (result.w() < 0) result.coeffs() *= -1;
  return result;
}

double swap_yaw(double yaw_rad, AutopilotWorld world) {
  return wrap_angle((world == AutopilotWorld::kNed ? std::numbers::pi / 2 : 0) - yaw_rad);
}

Mat6 swap_world_covariance(const Mat6& covariance, AutopilotWorld world) {
  return swap_both_parts(covariance, world_swap_matrix(world));
}

Mat6 swap_body_covariance(const Mat6& covariance) {
  return swap_both_parts(covariance, Vec3(1, -1, -1).asDiagonal());
}

Vec3 roll_pitch_yaw(const Eigen::Quaterniond& q) {
  const Mat3 R = q.normalized().toRotationMatrix();
  const double sin_pitch = std::fmin(1.0, std::fmax(-1.0, -R(2, 0)));
  return {std::atan2(R(2, 1), R(2, 2)), std::asin(sin_pitch), std::atan2(R(1, 0), R(0, 0))};
}

MavlinkCovariance upper_triangle(const Mat6& covariance) {
  MavlinkCovariance result{};
  std::size_t i = 0;
  for (int row = 0; row < 6; ++row)
    for (int column = row; column < 6; ++column) result[i++] = static_cast<float>(covariance(row, column));
  return result;
}

Mat6 from_upper_triangle(const MavlinkCovariance& covariance) {
  Mat6 result;
  std::size_t i = 0;
  for (int row = 0; row < 6; ++row)
    for (int column = row; column < 6; ++column)
      result(row, column) = result(column, row) = static_cast<double>(covariance[i++]);
  return result;
}

MavlinkCovariance unknown_covariance() {
  MavlinkCovariance result{};
  result[0] = std::numeric_limits<float>::quiet_NaN();
  return result;
}

}  // namespace hm
