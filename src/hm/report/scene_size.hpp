#pragma once
#include <optional>
#include <string>

#include "hm/geometry/triangle_mesh.hpp"
#include "hm/report/render/mesh_renderer.hpp"

namespace hm {

/// The size of what a mesh shows, robust against stray pieces.
struct SceneSize {
  double length_m = 0, width_m = 0, height_m = 0;  ///< along SceneExtent::T_world_scene's axes
  double area_m2 = 0;               ///< seen from above: surfaces that face up, below the ceiling
  std::optional<double> ceiling_m;  ///< height of the ceiling over the floor
};

/// Area in cells of 5 cm, each counted once if the middle of a triangle that faces up lies in it (or in one
/// of its neighbours on opposite sides). Zeros for an empty mesh.
SceneSize scene_size(const TriangleMesh& mesh, const SceneExtent& extent);

/// "8.1 \u00d7 5.2 m, 2.6 m high, 38 m\u00b2 seen from above".
std::string to_text(const SceneSize& size);

/// A box in the axes of SceneExtent::T_world_scene in square columns of `cell_m` metres.
struct CellGrid {
  Box3 box;
  double cell_m = 0;
  double most_cells = 0;  ///< along an axis
};
/// The columns that contain the middle of a triangle that faces up, at least 0.3 m below the ceiling: 1,
/// others 0, by x and y. Empty where the box has more cells along an axis than allowed.
Image<std::uint8_t> cells_facing_up(const TriangleMesh& mesh, const SceneExtent& extent,
                                    const CellGrid& grid);

}  // namespace hm
