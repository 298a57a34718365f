#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "hm/geometry/se3.hpp"

namespace hm {

// Eigen's solvers for small fixed sizes, compiled once, since each costs a second or more of compile time per
// translation unit. Results are bit-identical to Eigen's, but for the axis of turn_between() of opposite
// directions.

/// Solution x of A x = b for a symmetric, positive or negative semidefinite A (Eigen::LDLT).
Vec3 solve_symmetric_3(const Mat3& A, const Vec3& b);
Vec6 solve_symmetric(const Mat6& A, const Vec6& b);
/// Matrix inverse (Eigen: LU with partial pivoting).
Mat6 inverse_of(const Mat6& A);

/// Eigenvalues in increasing order, eigenvectors as columns (Eigen::SelfAdjointEigenSolver).
struct Eigen3 {
  Vec3 values;
  Mat3 vectors;
};
struct Eigen6 {
  Vec6 values;
  Mat6 vectors;
};
Eigen3 symmetric_eigen(const Mat3& A);
Eigen6 symmetric_eigen(const Mat6& A);
Vec3 symmetric_eigenvalues(const Mat3& A);
Vec6 symmetric_eigenvalues(const Mat6& A);

/// A = U diag(values) V^T, values in decreasing order (Eigen::JacobiSVD).
struct Svd3 {
  Mat3 U, V;
  Vec3 values;
};
Svd3 svd_of(const Mat3& A);

/// Shortest rotation that takes the direction `from` to `to` (Eigen::Quaterniond::FromTwoVectors, which
/// instantiates an SVD for opposite directions; here half a turn about any axis perpendicular to them).
Eigen::Quaterniond turn_between(const Vec3& from, const Vec3& to);

}  // namespace hm
