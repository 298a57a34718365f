#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "hm/core/parallel.hpp"
#include "hm/geometry/camera.hpp"
#include "hm/sim/world/world.hpp"

namespace hm {

/// Points on surfaces, world frame, with the surfaces' unit normals.
struct SurfacePoints {
  std::vector<Eigen::Vector3f> positions;
  std::vector<Eigen::Vector3f> normals;
};

/// When a surface counts as seen.
struct VisibilityParams {
  PinholeCamera camera;
  double min_depth_m = 0.4, max_depth_m = 4.0;
  double grazing_limit_rad = 1.36;
  double spacing_m = 0.03;  ///< one sample per spacing^2 of surface, on average
  std::uint64_t seed = 1;
};

/// Samples of the world's surface, uniform by area, that at least one camera sees: inside of its image,
/// within range, not grazing, not hidden, of a material that returns. Conservative: each sample is
/// tested exactly, but only against up to 16 cameras that are known to see its 10 cm surroundings.
SurfacePoints visible_surface_points(const World& world, std::span<const SE3> T_world_cameras,
                                     const VisibilityParams& params, const ParallelLoop& loop);

}  // namespace hm
