#pragma once
#include <memory>

#include "hm/odometry/image_pyramid.hpp"
#include "hm/odometry/pose_refinement.hpp"
#include "hm/odometry/surface_grid.hpp"
#include "hm/sensors/rgbd_frame.hpp"

namespace hm {

/// A frame as the tracker uses it.
struct TrackerFrame {
  const RgbdFrame* frame = nullptr;
  ImagePyramid pyramid;
  DepthGrid grid;
};

/// A landmark found in a frame.
struct LandmarkMatch {
  std::size_t landmark = 0;
  PointObservation observation;
  bool inlier = false;
};

}  // namespace hm
