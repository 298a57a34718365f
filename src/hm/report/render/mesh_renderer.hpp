#pragma once
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hm/core/parallel.hpp"
#include "hm/geometry/image.hpp"
#include "hm/geometry/trajectory.hpp"
#include "hm/geometry/triangle_mesh.hpp"

namespace hm {

/// Source of a surface's colour. kScalar: `RenderOptions::vertex_values` through a diverging colour map.
enum class RenderStyle { kShaded, kColor, kHeight, kScalar };

enum class Projection { kPerspective, kOrthographic };
enum class Faces { kFront, kBoth };

/// View of an image. The camera looks along its +z (x right, y down).
struct RenderView {
  SE3 T_world_camera;
  Projection projection = Projection::kPerspective;
  double focal_px = 0;          ///< perspective: focal length for the image's size
  double pixels_per_m = 0;      ///< orthographic
  Vec3 up = Vec3::UnitZ();      ///< unit, world; heights are measured along it
  Faces faces = Faces::kFront;  ///< kFront: back faces are not drawn, so that rooms are visible from outside
  /// Everything higher than this (metres along `up`) is cut away, if set.
  std::optional<double> cut_height_m;
};

struct RenderOptions {
  int width = 1600;
  int height = 1000;
  RenderStyle style = RenderStyle::kShaded;
  std::span<const float> vertex_values = {};  ///< kScalar: one per vertex, metres; NaN is drawn grey
  double value_limit = 0;                  ///< kScalar: the ends of the colour map, +-m; 0: 95th percentile
  std::string value_label = "error (mm)";  ///< kScalar: title of the legend, whose values are in millimetres
  const Trajectory* trajectory = nullptr;  ///< drawn as a line with its start and end
};

/// Up direction and extent of a mesh, robust against outliers (percentiles of its vertices).
struct SceneExtent {
  Vec3 up = Vec3::UnitZ();
  SE3 T_world_scene;   ///< z up, x along the longer main direction of the walls; most walls' fronts are seen
                       ///< from -y
  Box3 box;            ///< in scene axes: 0.2 to 99.8 percentiles, slightly padded
  double floor_m = 0;  ///< height of the floor along up
  std::optional<double> ceiling_m;  ///< height of the ceiling, if found
  std::vector<Vec3> points;         ///< surface points within the box, world, for fitting views
};
/// Computes the extent. `up_hint`: approximate up direction (a camera's mean -y, or z), refined by the
/// surfaces that face it within 25 degrees.
SceneExtent scene_extent(const TriangleMesh& mesh, const Vec3& up_hint = Vec3::UnitZ());
/// The same with a known up direction (unit), which is not refined.
SceneExtent scene_extent_along(const TriangleMesh& mesh, const Vec3& up);
/// Mean up direction of a camera held roughly upright; z without poses.
Vec3 up_of_cameras(const Trajectory& trajectory);

/// Three-quarter view from above into the rooms, without ceiling, that fills the image.
RenderView dollhouse_view(const SceneExtent& extent, const RenderOptions& options);
/// View from straight above, cut at this height over the floor.
RenderView plan_view(const SceneExtent& extent, const RenderOptions& options, double cut_above_floor_m = 1.4);
/// View of a camera of the recording.
RenderView camera_view(const SE3& T_world_camera, const RenderOptions& options);

/// Draws a mesh with 2x2 samples per pixel; bit-identical for any number of threads. Non-finite vertices and
/// invalid triangles are skipped; an empty mesh gives the background.
Image<Rgb8> render_mesh(const TriangleMesh& mesh, const RenderView& view, const RenderOptions& options,
                        const ParallelLoop& loop);
/// The same in several styles, all of one size: what is seen, and the light on it, is found once.
std::vector<Image<Rgb8>> render_styles(const TriangleMesh& mesh, const RenderView& view,
                                       std::span<const RenderOptions> styles, const ParallelLoop& loop);

/// Draws a floor plan: plan_view with cut walls in dark, a grid of metres and a scale bar.
Image<Rgb8> render_floor_plan(const TriangleMesh& mesh, const SceneExtent& extent,
                              const RenderOptions& options, const ParallelLoop& loop);

}  // namespace hm
