#pragma once
#include "hm/geometry/se2.hpp"
#include "hm/laser/matching/pl_icp.hpp"

namespace hm {

/// A sensed point and the reference line it is paired with.
struct PointLinePair {
  double nx = 0, ny = 0;  ///< unit normal of the line
  double px = 0, py = 0;  ///< the point, rotated by the current estimate but not translated
  double error = 0;       ///< signed residual: line offset - normal * transformed point
  double weight = 0;
};

/// Quadratic cost of one iteration in v = (dx, dy, cos, sin) of the remaining motion: sum of weight * (n . (R
/// p + dt) - n . p - error)^2, rotating about the sensed scan's origin.
struct PointToLineSums {
  Eigen::Matrix4d m = Eigen::Matrix4d::Zero();  ///< sum of weight * row * row^T (upper triangle)
  Eigen::Vector4d g = Eigen::Vector4d::Zero();  ///< sum of weight * row * error
  double weight = 0;                            ///< sum of weights
  double squared_range_m2 = 0;                  ///< weighted sum of squared ranges

  void add(const PointLinePair& pair) {
    const double a = pair.nx * pair.px + pair.ny * pair.py, b = pair.ny * pair.px - pair.nx * pair.py;
    const double wx = pair.weight * pair.nx, wy = pair.weight * pair.ny, wa = pair.weight * a,
                 wb = pair.weight * b;
    m(0, 0) += wx * pair.nx, m(0, 1) += wx * pair.ny, m(0, 2) += wx * a, m(0, 3) += wx * b;
    m(1, 1) += wy * pair.ny, m(1, 2) += wy * a, m(1, 3) += wy * b;
    m(2, 2) += wa * a, m(2, 3) += wa * b, m(3, 3) += wb * b;
    g(0) += wx * pair.error, g(1) += wy * pair.error, g(2) += wa * pair.error, g(3) += wb * pair.error;
    weight += pair.weight;
    squared_range_m2 += pair.weight * (pair.px * pair.px + pair.py * pair.py);
  }
  /// Information matrix of (x, y, angle) at the current estimate: J^T W J.
  [[nodiscard]] Mat3 information() const;
  /// Gradient J^T W error.
  [[nodiscard]] Vec3 gradient() const { return {g(0), g(1), g(3)}; }
  /// Root mean square range of the points, at least 1 cm; converts angles to metres.
  [[nodiscard]] double arm_m() const;
};

/// Globally optimal step (dx, dy, angle) in closed form: the translation is eliminated by a Schur complement,
/// the rotation is the largest root of the secular equation of c^2 + s^2 = 1 (Censi, ICRA 2008, whose quartic
/// has the same root). The translation block of `m` must be invertible.
Vec3 exact_step(const PointToLineSums& sums);

/// Thresholds of a free (unconstrained) direction.
struct InformationLimits {
  double min_ratio = 0;   ///< relative to the sum of weights
  double over_noise = 0;  ///< relative to the information expected from noise
};

/// Finds directions whose information is below the limits. `noise_information` is the information expected
/// from noise alone, in the form of PointToLineSums::information().
FreeDirections find_free_directions(const PointToLineSums& sums, const Mat3& noise_information,
                                    const InformationLimits& limits);

/// Gauss-Newton step without the free directions, which also reverts the component of `moved`, the motion so
/// far (dx, dy, angle), along them.
Vec3 step_without(const FreeDirections& free, const PointToLineSums& sums, const Vec3& moved);

/// Pseudo-inverse of the information for the covariance: inverse on the constrained subspace, zero along free
/// directions.
Mat3 inverse_information(const FreeDirections& free, const Mat3& information);

}  // namespace hm
