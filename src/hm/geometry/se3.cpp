#include "hm/geometry/se3.hpp"

#include <Eigen/SVD>
#include <cmath>

namespace hm {

Mat3 skew(const Vec3& a) {
  Mat3 m;
  m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return m;
}

Mat3 so3_exp(const Vec3& rotation_vector) {
  const double angle = rotation_vector.norm();
  if (angle < 1e-12) return Mat3::Identity() + skew(rotation_vector);
  return Eigen::AngleAxisd(angle, rotation_vector / angle).toRotationMatrix();
}

Vec3 so3_log(const Mat3& rotation) {
  Eigen::Quaterniond q(rotation);
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  const double sine = q.vec().norm();
  if (sine < 1e-12) return 2.0 * q.vec();
  return 2.0 * std::atan2(sine, q.w()) / sine * q.vec();
}

namespace {

/// The left Jacobian of SO(3) (Barfoot 2017, eq. 7.77b).
Mat3 left_jacobian(const Vec3& rotation_vector) {
  const double angle = rotation_vector.norm();
  const Mat3 w = skew(rotation_vector);
  if (angle < 1e-5) return Mat3::Identity() + 0.5 * w + w * w / 6.0;
  const double a2 = angle * angle;
  return Mat3::Identity() + (1.0 - std::cos(angle)) / a2 * w +
         (angle - std::sin(angle)) / (a2 * angle) * w * w;
}

}  // namespace

Result<SE3> SE3::from_matrix(const Mat4& matrix, double tolerance) {
  if (!matrix.allFinite()) return fail(ErrorCode::kInvalidValue, "", "a pose holds NaN or infinity");
  if ((matrix.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() > 1e-6)
    return fail(ErrorCode::kInvalidValue, "", "the last row of a pose is not 0 0 0 1");
  const Mat3 rotation = matrix.topLeftCorner<3, 3>();
  const double error = (rotation.transpose() * rotation - Mat3::Identity()).cwiseAbs().maxCoeff();
  if (error > tolerance)
    return fail(ErrorCode::kInvalidValue, "", "a pose is not rigid: R^T R differs from identity by {:.3g}",
                error);
  if (rotation.determinant() < 0) return fail(ErrorCode::kInvalidValue, "", "the rotation of a pose mirrors");
  const Eigen::JacobiSVD<Mat3> svd(rotation, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return SE3(Mat3(svd.matrixU() * svd.matrixV().transpose()), matrix.topRightCorner<3, 1>());
}

SE3 SE3::exp(const Vec6& twist) {
  const Vec3 w = twist.tail<3>();
  return {so3_exp(w), left_jacobian(w) * twist.head<3>()};
}

Vec6 SE3::log() const {
  const Vec3 w = so3_log(rotation_);
  Vec6 twist;
  twist << left_jacobian(w).partialPivLu().solve(translation_), w;
  return twist;
}

Mat4 SE3::matrix() const {
  Mat4 m = Mat4::Identity();
  m.topLeftCorner<3, 3>() = rotation_;
  m.topRightCorner<3, 1>() = translation_;
  return m;
}

SE3 SE3::inverse() const {
  const Mat3 transposed = rotation_.transpose();
  return {transposed, -(transposed * translation_)};
}

SE3 interpolate(const SE3& a, const SE3& b, double fraction) {
  return {a.quaternion().slerp(fraction, b.quaternion()),
          (1.0 - fraction) * a.translation() + fraction * b.translation()};
}

bool is_rigid(const SE3& motion) {
  const Mat3& r = motion.rotation();
  return r.allFinite() && motion.translation().allFinite() &&
         (r.transpose() * r - Mat3::Identity()).cwiseAbs().maxCoeff() < 1e-6 && r.determinant() > 0;
}

}  // namespace hm
