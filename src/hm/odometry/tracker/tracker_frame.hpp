#pragma once
#include <optional>

#include "hm/odometry/feature/image_pyramid.hpp"
#include "hm/odometry/registration/pose_refinement.hpp"
#include "hm/odometry/registration/surface_grid.hpp"
#include "hm/sensors/rgbd_frame.hpp"

namespace hm {

/// Up direction (opposite to gravity) in the model and as measured in the frame; unit vectors.
struct UpPrior {
  Vec3 up_odom = Vec3::UnitZ();
  Vec3 up_camera = Vec3::UnitZ();
  double sigma_rad = 0.02;
};

/// Preprocessed frame of the tracker.
struct TrackerFrame {
  const RgbdFrame* frame = nullptr;
  ImagePyramid pyramid;
  DepthGrid grid;
  std::optional<UpPrior> up;
};

/// Match of a landmark in a frame.
struct LandmarkMatch {
  std::size_t landmark = 0;
  PointObservation observation;
  bool inlier = false;
};

}  // namespace hm
