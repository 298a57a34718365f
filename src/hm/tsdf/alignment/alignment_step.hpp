#pragma once
#include "hm/geometry/se3.hpp"

namespace hm {

/// Centre of a left perturbation exp(xi), instead of the world's origin; xi = [shift; turn] in world axes.
/// About the readings' centroid, shifts and turns are nearly independent.
struct TurningCentre {
  Vec3 p_world = Vec3::Zero();
  double arm_m = 1;  ///< typical distance of the readings from the centre; converts turns to shifts

  /// Applies exp(xi) about the centre.
  [[nodiscard]] SE3 moved(const SE3& T_world_camera, const Vec6& xi) const;
  /// Perturbation xi that takes one pose to another.
  [[nodiscard]] Vec6 between(const SE3& T_world_from, const SE3& T_world_to) const;
  /// Jacobian d(xi about the world's origin) / d(xi about the centre).
  [[nodiscard]] Mat6 to_origin() const;
};

/// Observability of the directions of motion, from normal equations whose Jacobians have about unit length.
///
/// Unobservable shifts (along a corridor, across a wall) come first and are pure shifts: determined among
/// shifts only, their direction is much more accurate than that of an eigenvector that noise mixes with weak
/// turns. The eigenvectors of the remaining space follow.
struct Observability {
  Vec6 share =
      Vec6::Zero();  ///< eigenvalue of H over the sum of weights, ascending; free shifts, then the others
  Mat6 directions = Mat6::Zero();  ///< [shift; turn * arm_m], orthonormal columns
  int free_shifts = 3;
  int unobservable = 6;  ///< number of directions below the minimum share, including free shifts

  /// Returns `T_world_camera` with the camera's position along the free shifts taken from `T_world_prior`, to
  /// undo translation caused only by rotating about a distant centre.
  [[nodiscard]] SE3 held(const SE3& T_world_camera, const SE3& T_world_prior) const;
};
Observability observability(const Mat6& H, double weight, double arm_m, double min_share);

/// Information matrix about the centre and its gradient.
struct Information {
  Mat6 H = Mat6::Zero();
  Vec6 b = Vec6::Zero();
};
/// Restricts normal equations to the observable directions: solution remapping (Zhang, Kaess, Singh, ICRA
/// 2016) of the geometry, so that the prior alone determines the rest, coupled to the observable part by its
/// covariance.
Information observable_part(const Information& geometry, const Observability& seen, double arm_m);

/// Gauss-Newton step (Levenberg: `damping` times the diagonal is added): (H + damping) xi = -b. H must be
/// positive definite.
Vec6 damped_step(const Information& information, double damping);

/// Inverse of the information about the centre, as covariance about the world's origin; directions without
/// information get a variance of 1.
Mat6 covariance_at_origin(const Mat6& information, const TurningCentre& centre);

}  // namespace hm
