#pragma once
#include <span>
#include <vector>

#include "hm/core/parallel.hpp"
#include "hm/geometry/occupancy_grid_2d.hpp"
#include "hm/geometry/trajectory.hpp"
#include "hm/geometry/triangle_mesh.hpp"
#include "hm/report/mesh_figures.hpp"

namespace hm {

/// Mesh of the faces between occupied and other voxels, coloured by height (2nd to 98th percentile). All
/// voxels must have one size on one grid, as from MultiVolumeGrid::voxels.
TriangleMesh occupied_faces(std::span<const OccupancyVoxel> voxels, double size_m);

/// Path drawn over a map seen from above.
struct MapOverlay {
  std::string name;
  const Trajectory* path = nullptr;
  Rgb8 color;
};

/// Names and colours of the paths, for the legend below the figure.
std::vector<HtmlReport::Swatch> legend_of(std::span<const MapOverlay> paths);
/// Sets the scale bar below a figure of a map that is `metres` wide: a round length, at most a third of the
/// width.
void set_scale(Figure& figure, double metres);

/// Draws a horizontal occupancy grid from above (x to the right, y up): occupied dark, free light, unknown
/// grey; with paths. Legend and scale bar are outside of the image (legend_of, set_scale). Nothing for an
/// empty grid.
std::optional<Image<Rgb8>> draw_occupancy_grid(const OccupancyGrid2D& grid,
                                               std::span<const MapOverlay> paths);

/// Draws the highest occupied voxel of each column from above, coloured by its height along `up` (unit), with
/// a legend. Nothing without occupied voxels.
std::optional<Image<Rgb8>> draw_heights(std::span<const OccupancyVoxel> voxels, double size_m,
                                        const Vec3& up = Vec3::UnitZ());

}  // namespace hm
