#pragma once
#include <optional>

#include "hm/odometry/registration/surface_alignment.hpp"

namespace hm {

/// A motion that two depth pictures lead to.
struct SurfaceMotion {
  SE3 T_ref_cur;
  bool held = false;  ///< in all directions: the surfaces alone decide
};

/// The motion between two depth pictures by their surfaces alone (point to plane with gates that narrow): for
/// pictures whose patterns repeat, or that have none. Where the surfaces do not hold the camera (a plane, a
/// corridor) the guess stays. Nothing when too little of the surface is found again.
std::optional<SurfaceMotion> follow_surface(std::span<const SurfaceElement> reference,
                                            const DepthGrid& current, const SE3& T_ref_cur_guess,
                                            const DepthNoise& noise);

}  // namespace hm
