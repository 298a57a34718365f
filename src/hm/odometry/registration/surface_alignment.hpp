#pragma once
#include <span>

#include "hm/odometry/registration/pose_equations.hpp"
#include "hm/odometry/registration/surface_grid.hpp"

namespace hm {

/// Parameters for comparing depth readings with a reference surface.
struct SurfaceMatching {
  DepthNoise noise;
  int stride = 2;              ///< every n-th cell in both directions
  double gate_sigmas = 4;      ///< residuals beyond are ignored
  double extra_gate_m = 0.03;  ///< added to the gate, for an inaccurate initial pose
};

/// Normal equations of the camera's pose (perturbation in the current camera's frame) from the point-to-plane
/// distances of its readings to the reference surface (Chen and Medioni 1992, projective association),
/// weighted by their variances, robust (Cauchy).
PoseEquations surface_equations(const SurfaceGrid& reference, const DepthGrid& current, const SE3& T_ref_cur,
                                const SurfaceMatching& matching);

/// The same for a few reference elements that need not lie on a grid: each is looked up in the current
/// readings (the stride is ignored).
PoseEquations surface_equations(std::span<const SurfaceElement> reference, const DepthGrid& current,
                                const SE3& T_ref_cur, const SurfaceMatching& matching);

}  // namespace hm
