#pragma once
#include <optional>

#include "hm/odometry/registration/surface_alignment.hpp"

namespace hm {

/// Motion estimated between two depth images.
struct SurfaceMotion {
  SE3 T_ref_cur;
  bool held = false;  ///< the surfaces constrain all directions
};

/// Estimates the motion between two depth images from their surfaces only (point-to-plane ICP with narrowing
/// gates), for images with repeating or no texture. Unconstrained directions (a plane, a corridor) keep the
/// guess. Nothing when too little of the surface is found.
std::optional<SurfaceMotion> follow_surface(std::span<const SurfaceElement> reference,
                                            const DepthGrid& current, const SE3& T_ref_cur_guess,
                                            const DepthNoise& noise);

}  // namespace hm
