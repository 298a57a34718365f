#pragma once
#include <vector>

#include "hm/odometry/inertial/inertial_window.hpp"
#include "hm/odometry/registration/surface_alignment.hpp"
#include "hm/odometry/tracker/local_map.hpp"
#include "hm/odometry/tracker/tracker_frame.hpp"

namespace hm {

struct RegistrationParams {
  double surface_weight_ratio = 0.05;  ///< below 1, since readings of one surface are correlated
  bool adapt_variance = false;         ///< scale the matches' variances to their residuals (median)
  int max_iterations = 10;
  DepthNoise noise;
};

struct Registration {
  SE3 T_odom_camera;
  Mat6 information = Mat6::Zero();  ///< for a perturbation in the camera's frame
  int inliers = 0;
  double variance_scale = 1;    ///< ratio of squared residuals to their expectation (median)
  PoseEquations by_prior = {};  ///< part of the information, and its slope
};

/// Estimates the pose from the matched landmarks and the surface of the newest keyframe: Gauss-Newton,
/// information-weighted and robust. Marks the inliers among the matches.
Registration register_frame(const LocalMap& map, const TrackerFrame& frame,
                            std::vector<LandmarkMatch>& matches, const SE3& T_odom_camera_guess,
                            const PinholeCamera& camera, const RegistrationParams& params);

/// Standard deviation of the position in its least certain direction, without scaling by the residuals.
double position_sigma_m(const Registration& registration);

/// Covariance of the pose relative to the model, for a perturbation in the camera's frame: the inverse
/// information, scaled by the residuals.
Mat6 covariance_in_camera(const Registration& registration);

/// The same for a left perturbation in odom, as in TrackedFrame.
Mat6 covariance_in_odom(const Registration& registration);

/// Normal equations of a pose from the up direction, which constrains roll and pitch only.
PoseEquations up_equations(const UpPrior& up, const SE3& T_odom_camera);

/// Normal equations of a pose from a prior.
PoseEquations prior_equations(const PosePrior& prior, const SE3& T_odom_camera);

/// The pose of the prior alone.
Registration registration_by_prior(const PosePrior& prior);

/// Covariance of the pose by the inverse of its information.
double covariance_scale(const Registration& registration);

/// Creates a factor between a keyframe's surface and another frame's depth readings, linearised at its
/// current pose. `rows`: motion of the other frame.
SurfaceFactor surface_factor(const MapKeyframe& reference, const DepthGrid& grid, const SE3& T_odom_camera,
                             const RowMotion& rows, const RegistrationParams& params);

/// The same from a prior: the motion since the keyframe by inertial readings.
SurfaceFactor prior_factor(const MapKeyframe& reference, const PosePrior& prior);

/// The same from the rotation since the keyframe by the gyroscope.
SurfaceFactor turn_factor(const MapKeyframe& reference, const GyroTurn& turn, const SE3& T_odom_camera);

}  // namespace hm
