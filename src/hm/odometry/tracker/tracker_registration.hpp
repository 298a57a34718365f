#pragma once
#include <vector>

#include "hm/odometry/registration/surface_alignment.hpp"
#include "hm/odometry/tracker/local_map.hpp"
#include "hm/odometry/tracker/tracker_frame.hpp"

namespace hm {

struct RegistrationParams {
  double surface_weight_ratio = 0.05;  ///< readings of one surface are not independent
  bool adapt_variance = false;         ///< take the matches for as uncertain as their residuals are (median)
  int max_iterations = 10;
  DepthNoise noise;
};

struct Registration {
  SE3 T_odom_camera;
  Mat6 information = Mat6::Zero();  ///< of a perturbation in the camera's frame
  int inliers = 0;
  double variance_scale = 1;  ///< squared residuals of the matches against what was expected (median)
};

/// The pose that agrees best with the landmarks found and with the surface of the newest keyframe:
/// Gauss-Newton, information-weighted and robust. Marks the inliers among the matches.
Registration register_frame(const LocalMap& map, const TrackerFrame& frame,
                            std::vector<LandmarkMatch>& matches, const SE3& T_odom_camera_guess,
                            const PinholeCamera& camera, const RegistrationParams& params);

/// The standard deviation of the position in its least certain direction, if all residuals were as expected.
double position_sigma_m(const Registration& registration);

/// The covariance of the pose against the model, by a move in the camera's frame: the inverse of the
/// information, scaled by how large the residuals are.
Mat6 covariance_in_camera(const Registration& registration);

/// The covariance of the pose against the model, by a move in odom (left perturbation, as in TrackedFrame).
Mat6 covariance_in_odom(const Registration& registration);

/// The normal equations of a pose from the direction away from gravity: of roll and pitch, nothing else.
PoseEquations up_equations(const UpPrior& up, const SE3& T_odom_camera);

/// A factor between the surface of a keyframe and the readings of another frame at its present pose.
SurfaceFactor surface_factor(const MapKeyframe& reference, const DepthGrid& grid, const SE3& T_odom_camera,
                             const RegistrationParams& params);

}  // namespace hm
