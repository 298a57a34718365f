#pragma once
#include <span>

#include "hm/odometry/registration/pose_equations.hpp"
#include "hm/odometry/registration/surface_grid.hpp"

namespace hm {

/// How readings of depth are compared with a surface seen before.
struct SurfaceMatching {
  DepthNoise noise;
  int stride = 2;              ///< every n-th cell in both directions
  double gate_sigmas = 4;      ///< residuals beyond do not count
  double extra_gate_m = 0.03;  ///< added to the gate, for a pose that is not yet good
};

/// The normal equations of the camera's pose (perturbation in the current camera's frame) from the distances
/// of its readings to the planes of the reference surface (Chen and Medioni 1992, projective association),
/// each weighted by its variance, robust (Cauchy).
PoseEquations surface_equations(const SurfaceGrid& reference, const DepthGrid& current, const SE3& T_ref_cur,
                                const SurfaceMatching& matching);

/// The normal equations of single elements, every one looked up among the current readings (the stride does
/// not count): for a few elements that need not lie on a grid.
PoseEquations surface_equations(std::span<const SurfaceElement> reference, const DepthGrid& current,
                                const SE3& T_ref_cur, const SurfaceMatching& matching);

}  // namespace hm
