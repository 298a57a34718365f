#pragma once
#include <vector>

#include "hm/geometry/camera.hpp"
#include "hm/sensors/depth_noise.hpp"
#include "hm/sensors/rgbd_frame.hpp"

namespace hm {

/// A depth image at a quarter of its resolution: each cell of 4x4 pixels has the mean of the readings in its
/// middle that agree with each other, in metres; 0 for none.
struct DepthGrid {
  static constexpr int kCell_px = 4;
  PinholeCamera camera;  ///< of the grid: pixels are cells
  Image<float> depth_m;
};
DepthGrid make_depth_grid(const DepthImage& depth, const PinholeCamera& camera, const DepthNoise& noise,
                          double max_depth_m);

/// A cell of a surface: the point on its ray and the unit normal towards the camera, camera frame.
/// `sigma_m` (along the normal) is 0 where there is no surface.
struct SurfaceElement {
  Eigen::Vector3f point = Eigen::Vector3f::Zero();
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();
  float sigma_m = 0;
};

/// The surface that a depth grid shows, as planes: in each window of 5x5 cells 1/z is linear in the pixel
/// where the surface is a plane, which is fitted to the readings that belong together.
struct SurfaceGrid {
  PinholeCamera camera;
  Image<SurfaceElement> elements;
  [[nodiscard]] std::size_t memory_bytes() const { return elements.size() * sizeof(SurfaceElement); }
};
SurfaceGrid make_surface_grid(const DepthGrid& grid, const DepthNoise& noise);
/// The elements of every `stride`-th cell in both directions, those with a surface alone.
std::vector<SurfaceElement> sample_surface(const DepthGrid& grid, const DepthNoise& noise, int stride);

}  // namespace hm
