#pragma once
#include <optional>

#include "hm/odometry/feature/image_pyramid.hpp"
#include "hm/odometry/registration/pose_refinement.hpp"
#include "hm/odometry/registration/surface_grid.hpp"
#include "hm/odometry/tracker/row_motion.hpp"
#include "hm/sensors/rgbd_frame.hpp"

namespace hm {

/// Up direction (opposite to gravity) in the model and as measured in the frame; unit vectors.
struct UpPrior {
  Vec3 up_odom = Vec3::UnitZ();
  Vec3 up_camera = Vec3::UnitZ();
  double sigma_rad = 0.02;
};

/// Pose by inertial readings: for T = T_odom_camera exp(d) the cost is d^T information d / 2.
struct PosePrior {
  SE3 T_odom_camera;
  Mat6 information = Mat6::Zero();  ///< in the units of the registration's, which is scaled
  double scale = 1;                 ///< of these units: the registration's covariance by its information
};

/// Preprocessed frame of the tracker.
struct TrackerFrame {
  const RgbdFrame* frame = nullptr;
  ImagePyramid pyramid;
  DepthGrid grid;
  std::optional<UpPrior> up;
  std::optional<PosePrior> prior;
  RowMotionModel motion;  ///< of the rows of the colour image
};

inline bool has_color(const TrackerFrame& view) { return view.pyramid.levels() > 0; }

/// The frame with its pyramid (none without colour) and depth grid; readings beyond `max_depth_m` are left
/// out.
TrackerFrame make_tracker_frame(const RgbdFrame& frame, const PinholeCamera& camera, const DepthNoise& noise,
                                double max_depth_m);

/// Match of a landmark in a frame.
struct LandmarkMatch {
  std::size_t landmark = 0;
  PointObservation observation;  ///< its pixel and depth are at the time of the middle row
  bool inlier = false;
  Vec2 image_pixel = Vec2::Zero();  ///< in the colour image

  template <class Archive>
  void visit_state(Archive& archive) {
    archive(landmark, observation, inlier, image_pixel);
  }
};

}  // namespace hm
