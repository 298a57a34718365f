#include "hm/laser/matching/point_to_line_step.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace hm {
namespace {

constexpr int kMaxNewtonSteps = 50;

/// argmin of v^T S v - 2 h^T v on the unit circle: (S + lambda I) v = h with the lambda above -s_min for
/// which |v| = 1. Newton's method on 1/|v| - 1, which is concave and nearly straight, from the left (More and
/// Sorensen 1983).
Vec2 minimise_on_circle(const Mat2& s, const Vec2& h) {
  const Eigen::SelfAdjointEigenSolver<Mat2> eigen = [&] {
    Eigen::SelfAdjointEigenSolver<Mat2> solver;
    solver.computeDirect(s);
    return solver;
  }();
  const Vec2 values = eigen.eigenvalues();
  const Vec2 b = eigen.eigenvectors().transpose() * h;
  double lambda = std::max(std::abs(b.x()) - values.x(), std::abs(b.y()) - values.y());
  const double scale = std::max({std::abs(values.x()), std::abs(values.y()), b.norm(), 1e-300});
  // Zero gradient along the weakest direction: the solution lies along it, in either direction (the "hard
  // case").
  if (lambda <= -values.x() + 1e-15 * scale) lambda = -values.x() + 1e-15 * scale;
  for (int i = 0; i < kMaxNewtonSteps; ++i) {
    const Vec2 v(b.x() / (values.x() + lambda), b.y() / (values.y() + lambda));
    const double norm = v.norm();
    if (norm <= 1.0 + 1e-15) break;
    const double slope =
        (v.x() * v.x() / (values.x() + lambda) + v.y() * v.y() / (values.y() + lambda)) / norm;
    const double next = lambda + (norm - 1.0) * norm / slope;
    if (!(next > lambda)) break;
    lambda = next;
  }
  Vec2 v(b.x() / (values.x() + lambda), b.y() / (values.y() + lambda));
  if (v.norm() < 1.0 - 1e-9) v.x() = std::copysign(std::sqrt(std::max(0.0, 1.0 - v.y() * v.y())), v.x());
  return (eigen.eigenvectors() * v).normalized();
}

}  // namespace

Mat3 PointToLineSums::information() const {
  Mat3 h;
  h << m(0, 0), m(0, 1), m(0, 3),  //
      m(0, 1), m(1, 1), m(1, 3),   //
      m(0, 3), m(1, 3), m(3, 3);
  return h;
}

double PointToLineSums::arm_m() const {
  return weight > 0 ? std::max(0.01, std::sqrt(squared_range_m2 / weight)) : 1.0;
}

Vec3 exact_step(const PointToLineSums& sums) {
  // Right-hand side for v: offsets are n.p + error, and n.p is the third row's own column.
  const auto m = sums.m.selfadjointView<Eigen::Upper>();
  const Eigen::Matrix4d full = m;
  const Eigen::Vector4d rhs = full.col(2) + sums.g;
  const Mat2 a_inverse = full.topLeftCorner<2, 2>().inverse();
  const Mat2 b = full.topRightCorner<2, 2>();
  Mat2 s = full.bottomRightCorner<2, 2>() - b.transpose() * a_inverse * b;
  s(1, 0) = s(0, 1);
  const Vec2 h = rhs.tail<2>() - b.transpose() * a_inverse * rhs.head<2>();
  const Vec2 turn = minimise_on_circle(s, h);
  const Vec2 shift = a_inverse * (rhs.head<2>() - b * turn);
  return {shift.x(), shift.y(), std::atan2(turn.y(), turn.x())};
}

FreeDirections find_free_directions(const PointToLineSums& sums, const Mat3& noise_information,
                                    const InformationLimits& limits) {
  FreeDirections free;
  free.arm_m = sums.arm_m();
  const Vec3 scale(1, 1, 1 / free.arm_m);
  const Mat3 scaled = scale.asDiagonal() * sums.information() * scale.asDiagonal();
  const Mat3 noise = scale.asDiagonal() * noise_information * scale.asDiagonal();
  Eigen::SelfAdjointEigenSolver<Mat3> eigen(scaled);
  for (int k = 0; k < 3; ++k) {
    const Vec3 direction = eigen.eigenvectors().col(k);
    const double information = eigen.eigenvalues()(k);
    const double by_noise = direction.dot(noise * direction);
    if (information >= limits.min_ratio * sums.weight && information > limits.over_noise * by_noise) continue;
    free.directions[static_cast<std::size_t>(free.count++)] = direction;
  }
  return free;
}

Mat3 inverse_information(const FreeDirections& free, const Mat3& information) {
  const Vec3 scale(1, 1, 1 / free.arm_m);
  Mat3 scaled = scale.asDiagonal() * information * scale.asDiagonal();
  // Free directions get so much information that their inverse is negligible, and are then removed.
  Mat3 keep = Mat3::Identity();
  for (int k = 0; k < free.count; ++k) {
    const Vec3& direction = free.directions[static_cast<std::size_t>(k)];
    keep -= direction * direction.transpose();
  }
  const double large = std::max(scaled.trace(), 1e-12);
  scaled = keep * scaled * keep + large * (Mat3::Identity() - keep);
  const Mat3 inverse = keep * scaled.inverse() * keep;
  return scale.asDiagonal() * inverse * scale.asDiagonal();
}

Vec3 step_without(const FreeDirections& free, const PointToLineSums& sums, const Vec3& moved) {
  Vec3 step = inverse_information(free, sums.information()) * sums.gradient();
  const Vec3 scale(1, 1, free.arm_m);
  for (int k = 0; k < free.count; ++k) {
    const Vec3& direction = free.directions[static_cast<std::size_t>(k)];
    step -= direction.dot(scale.cwiseProduct(moved)) * direction.cwiseQuotient(scale);
  }
  return step;
}

}  // namespace hm
