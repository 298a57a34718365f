#pragma once
#include <optional>
#include <vector>

#include "hm/geometry/camera.hpp"
#include "hm/sensors/depth_noise.hpp"
#include "hm/sensors/rgbd_frame.hpp"

namespace hm {

/// Depth image at a quarter of its resolution: each cell of 4x4 pixels holds the mean of the consistent
/// readings in its centre, in metres; 0 for none.
struct DepthGrid {
  static constexpr int kCell_px = 4;
  PinholeCamera camera;  ///< of the grid: pixels are cells
  Image<float> depth_m;
};
/// The reading of a depth grid in one cell.
struct GridReading {
  Vec2 cell;
  double depth_m = 0;
};
/// What a grid reads where a point, in its camera's frame, is seen; nothing outside it, nearer than 0.05 m,
/// or where there is no reading.
std::optional<GridReading> reading_at(const DepthGrid& grid, const Vec3& p_camera);
DepthGrid make_depth_grid(const DepthImage& depth, const PinholeCamera& camera, const DepthNoise& noise,
                          double max_depth_m);

/// Surface element: point on the cell's ray and unit normal towards the camera, camera frame. `sigma_m`
/// (along the normal) is 0 where there is no surface.
struct SurfaceElement {
  Eigen::Vector3f point = Eigen::Vector3f::Zero();
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();
  float sigma_m = 0;
};

/// Surface of a depth grid as local planes, fitted to the consistent readings in each window of 5x5 cells; on
/// a plane, 1/z is linear in the pixel coordinates.
struct SurfaceGrid {
  PinholeCamera camera;
  Image<SurfaceElement> elements;
  [[nodiscard]] std::size_t memory_bytes() const { return elements.size() * sizeof(SurfaceElement); }
};
SurfaceGrid make_surface_grid(const DepthGrid& grid, const DepthNoise& noise);
/// Surface elements of every `stride`-th cell in both directions, only where there is a surface.
std::vector<SurfaceElement> sample_surface(const DepthGrid& grid, const DepthNoise& noise, int stride);

}  // namespace hm
