#pragma once
#include "hm/geometry/se3.hpp"

namespace hm {

/// The left perturbation exp(xi) about a point instead of the world's origin: [shift; turn] in world axes.
/// With the readings' centroid as that point, shifts and turns are nearly independent.
struct TurningCentre {
  Vec3 p_world = Vec3::Zero();
  double arm_m =
      1;  ///< typical distance of the readings from it: a turn counts as the shift that it gives them

  /// exp(xi) T about the centre.
  [[nodiscard]] SE3 moved(const SE3& T_world_camera, const Vec6& xi) const;
  /// The xi that moves one pose to another.
  [[nodiscard]] Vec6 between(const SE3& T_world_from, const SE3& T_world_to) const;
  /// d(xi about the world's origin) / d(xi about the centre).
  [[nodiscard]] Mat6 to_origin() const;
};

/// Which directions of motion the geometry sees, from normal equations whose every reading has a Jacobian of
/// about unit length.
///
/// Shifts that no reading sees (along a corridor, across a wall) come first and are pure: found among shifts
/// alone, their direction is far more certain than that of an eigenvector that noise mixes with weak turns.
/// Then, of what is left, the eigenvectors.
struct Observability {
  Vec6 share = Vec6::Zero();       ///< of H over the sum of weights, ascending; free shifts, then the others
  Mat6 directions = Mat6::Zero();  ///< [shift; turn * arm_m], orthonormal columns
  int free_shifts = 3;
  int unobservable = 6;  ///< directions below the least share, free shifts among them

  /// `T_world_camera` with the camera put back to where `T_world_prior` has it along the free shifts: turning
  /// about something far away moves a camera, and nothing that was seen asks for that.
  [[nodiscard]] SE3 held(const SE3& T_world_camera, const SE3& T_world_prior) const;
};
Observability observability(const Mat6& H, double weight, double arm_m, double min_share);

/// Information about the centre and its gradient.
struct Information {
  Mat6 H = Mat6::Zero();
  Vec6 b = Vec6::Zero();
};
/// What normal equations say about the observable directions only: solution remapping (Zhang, Kaess, Singh,
/// ICRA 2016) of the geometry, so that the prior alone decides the rest, and couples it to what is seen as
/// its covariance tells (a camera that turns to face a wall need not move).
Information observable_part(const Information& geometry, const Observability& seen, double arm_m);

/// The step of Gauss-Newton (Levenberg: `damping` times the diagonal is added): (H + damping) xi = -b. H must
/// be positive definite.
Vec6 damped_step(const Information& information, double damping);

/// The inverse of the information about the centre, as covariance about the world's origin; directions that
/// have none get a variance of 1.
Mat6 covariance_at_origin(const Mat6& information, const TurningCentre& centre);

}  // namespace hm
