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
struct Observability {
  Vec6 share = Vec6::Zero();       ///< eigenvalues of H over the sum of weights, ascending
  Mat6 directions = Mat6::Zero();  ///< [shift; turn * arm_m], orthonormal columns
  int unobservable = 6;            ///< of them, below the least share
};
Observability observability(const Mat6& H, double weight, double arm_m, double min_share);

/// A step of Gauss-Newton (Levenberg: `damping` times the diagonal is added) that leaves alone what is not
/// observable: solution remapping (Zhang, Kaess, Singh, ICRA 2016). Solves (H + damping) xi = -b within the
/// observable directions.
Vec6 remapped_step(const Mat6& H, const Vec6& b, const Observability& seen, const TurningCentre& centre,
                   double damping);

/// The inverse of the information about the centre, as covariance about the world's origin; directions that
/// have none get a variance of 1.
Mat6 covariance_at_origin(const Mat6& information, const TurningCentre& centre);

}  // namespace hm
