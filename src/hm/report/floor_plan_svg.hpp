#pragma once
#include <string>
#include <vector>

#include "hm/geometry/trajectory.hpp"
#include "hm/geometry/triangle_mesh.hpp"
#include "hm/report/render/mesh_renderer.hpp"
#include "hm/report/scene_size.hpp"

namespace hm {

/// The extent with its box widened in the plane to hold the path too: by at most its own longer side on each
/// side, so that a path that went astray does not make the scene a dot. The same without a path.
SceneExtent framed(SceneExtent extent, const Trajectory* path);

/// A floor plan as lines (one self-contained <svg> element, also a valid file): where the mesh meets the
/// plane 1.4 m over the floor (or the middle of a lower scene), chained and thinned to within 1 cm; what was
/// seen of the floor and of things on it, tinted; the path if there is one; outer dimensions, scale bar,
/// area, ceiling height. Empty for an empty mesh.
std::string floor_plan_svg(const TriangleMesh& mesh, const SceneExtent& extent, const SceneSize& size,
                           const Trajectory* path);

/// A flight over a floor plan.
struct PlanFlight {
  const Trajectory* path = nullptr;  ///< T_world_base; at least two poses
  double playback_s = 15;            ///< of the whole flight
  std::vector<Vec3> way_points;      ///< world; may be empty
};

/// The walls as floor_plan_svg() draws them, and a vehicle that flies between them again and again (SMIL):
/// its path, its heading, and below the plan its height over time (metres). A picture where nothing moves.
/// Empty for an empty mesh or less than two poses.
std::string flight_plan_svg(const TriangleMesh& mesh, const SceneExtent& extent, const PlanFlight& flight);

}  // namespace hm
