#pragma once
#include <vector>

#include "hm/core/rng.hpp"
#include "hm/sensors/rgbd_frame.hpp"

namespace hm {

/// Analytic scene for tests, made of solid half spaces and balls, with exact depth images and signed
/// distances.
struct AnalyticScene {
  struct Plane {
    Vec3 normal;      ///< outwards, unit
    double offset_m;  ///< normal . p = offset on the plane
  };
  struct Ball {
    Vec3 centre;
    double radius_m;
  };
  std::vector<Plane> planes;
  std::vector<Ball> balls;

  /// Exact distance to the nearest surface, negative inside a solid (for points not inside two).
  [[nodiscard]] double distance(const Vec3& p_world) const;
  /// Distance along a ray to the first surface; infinity without one.
  [[nodiscard]] double cast(const Vec3& origin, const Vec3& direction) const;
  /// Renders the noise-free depth image in units of `unit_m`; colours encode the world position.
  [[nodiscard]] RgbdFrame render(const PinholeCamera& camera, const SE3& T_world_camera,
                                 double unit_m = 1e-4) const;
};

/// A random scene around the origin, and a random pose that looks roughly along +x from around the origin.
AnalyticScene random_scene(Rng& rng);
SE3 random_pose(Rng& rng);
/// Pose of a camera that looks along world +x from a position, image up = world +z.
SE3 looking_along_x(const Vec3& position);

}  // namespace hm
