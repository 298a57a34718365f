#pragma once
#include <array>
#include <cmath>

#include "hm/geometry/camera.hpp"
#include "hm/geometry/se3.hpp"

/// Shared by the bundle adjustments of cameras and boards: transforms and intrinsics as parameter blocks, for
/// any scalar type (Ceres).
namespace hm::detail {

/// Rigid transform as a parameter block: rotation vector, translation.
using Motion = std::array<double, 6>;
/// Intrinsics as a parameter block: fx fy cx cy.
using Intrinsics = std::array<double, 4>;

inline Motion to_motion(const SE3& T) {
  const Vec3 r = so3_log(T.rotation()), &t = T.translation();
  return {r.x(), r.y(), r.z(), t.x(), t.y(), t.z()};
}

inline SE3 to_se3(const Motion& m) { return {so3_exp(Vec3(m[0], m[1], m[2])), Vec3(m[3], m[4], m[5])}; }

inline Intrinsics intrinsics_of(const PinholeCamera& c) { return {c.fx, c.fy, c.cx, c.cy}; }

inline void set_intrinsics(PinholeCamera& c, const Intrinsics& k) {
  c.fx = k[0], c.fy = k[1], c.cx = k[2], c.cy = k[3];
}

/// Rotates a point by a rotation vector (Rodrigues' formula).
template <class T>
void turn(const T* r, const T* p, T* turned) {
  using std::cos, std::sin, std::sqrt;
  const T angle2 = r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
  const bool is_small = !(angle2 > 1e-20);
  const T angle = is_small ? T(1) : sqrt(angle2);
  const T along = is_small ? T(1) : T(cos(angle)), across = is_small ? T(1) : T(sin(angle) / angle);
  const T dot = r[0] * p[0] + r[1] * p[1] + r[2] * p[2];
  const T left = is_small ? T(0) : T((1.0 - along) / angle2 * dot);
  turned[0] = along * p[0] + across * (r[1] * p[2] - r[2] * p[1]) + left * r[0];
  turned[1] = along * p[1] + across * (r[2] * p[0] - r[0] * p[2]) + left * r[1];
  turned[2] = along * p[2] + across * (r[0] * p[1] - r[1] * p[0]) + left * r[2];
}

template <class T>
void move(const T* motion, const T* point, T* moved) {
  turn(motion, point, moved);
  for (int i = 0; i < 3; ++i) moved[i] += motion[3 + i];
}

/// Reprojection error, projected minus observed, with the plumb-bob model of PinholeCamera::project.
template <class T>
void residual_px(const T* intrinsics, const LensDistortion& d, const Vec2& seen, const T* p, T* residual) {
  const T x = p[0] / p[2], y = p[1] / p[2], r2 = x * x + y * y;
  const T radial = 1.0 + r2 * (d.k1 + r2 * (d.k2 + r2 * d.k3));
  const T u = x * radial + 2.0 * d.p1 * x * y + d.p2 * (r2 + 2.0 * x * x);
  const T v = y * radial + d.p1 * (r2 + 2.0 * y * y) + 2.0 * d.p2 * x * y;
  residual[0] = intrinsics[0] * u + intrinsics[2] - seen.x();
  residual[1] = intrinsics[1] * v + intrinsics[3] - seen.y();
}

/// Residual of a board corner observed by the camera in whose frame the board's pose is given.
struct CornerInCamera {
  Vec3 point;
  Vec2 seen;
  LensDistortion distortion;
  double sigma_px = 1;
  template <class T>
  bool operator()(const T* board, const T* intrinsics, T* residual) const {
    const T on_board[3] = {T(point.x()), T(point.y()), T(point.z())};
    T p[3];
    move(board, on_board, p);
    residual_px(intrinsics, distortion, seen, p, residual);
    for (int i = 0; i < 2; ++i) residual[i] /= T(sigma_px);
    return true;
  }
};

}  // namespace hm::detail
