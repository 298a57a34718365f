#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "hm/core/parallel.hpp"
#include "hm/geometry/camera.hpp"
#include "hm/sim/world/world.hpp"

namespace hm {

/// Points on surfaces with unit normals, world frame.
struct SurfacePoints {
  std::vector<Eigen::Vector3f> positions;
  std::vector<Eigen::Vector3f> normals;
};

/// Conditions for a visible surface.
struct VisibilityParams {
  PinholeCamera camera;
  double min_depth_m = 0.4, max_depth_m = 4.0;
  double grazing_limit_rad = 1.36;
  double spacing_m = 0.03;  ///< one sample per spacing^2 of surface, on average
  std::uint64_t seed = 1;
};

/// Samples the world's surface uniformly by area and returns the points visible in at least one camera:
/// inside its image, within range, not grazing, not occluded, of a reflecting material. Conservative: each
/// sample is tested exactly, but only against up to 16 cameras known to observe its 10 cm neighbourhood.
SurfacePoints visible_surface_points(const World& world, std::span<const SE3> T_world_cameras,
                                     const VisibilityParams& params, const ParallelLoop& loop);

}  // namespace hm
