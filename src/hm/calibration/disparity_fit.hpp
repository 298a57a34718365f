#pragma once
#include <span>

#include "hm/calibration/depth_refine.hpp"
#include "hm/depth_camera/disparity.hpp"

namespace hm {

/// A depth camera that gives raw disparity, beside a colour camera.
struct DisparityCamera {
  PinholeCamera camera;  ///< without distortion
  SE3 T_color_depth;
  DisparityModel disparity;
};

/// What the first Kinect is by design, 640 x 480: the focal length that its driver assumes (575.8 px), the
/// centre of the image, the colour camera 25 mm beside it, OpenKinect's constants of disparity.
DisparityCamera nominal_kinect();

/// How well the camera and the motion are known before the fit (standard deviations).
struct DisparityPrior {
  double focal_px = 15, centre_px = 10;
  double translation_m = 0.005, rotation_rad = 0.02;
};

struct DisparityFit {
  DisparityCamera found;
  double before_rms = 0, after_rms = 0;  ///< units of disparity, over blocks of readings
  std::size_t blocks = 0;
  double offset_sigma_per_m = 0, slope_sigma_per_m = 0;
  double focal_sigma_px = 0, centre_sigma_px = 0;
  Vec3 translation_sigma_m = Vec3::Zero(), rotation_sigma_rad = Vec3::Zero();
};

/// The two constants of raw disparity, the depth camera's focal lengths and centre and the motion to the
/// colour camera, from boards whose poses the colour camera saw: disparity is linear in the inverse depth of
/// the board's plane (the model of Herrera, Kannala and Heikkila 2012, without its distortion of disparity).
/// `poses[i].depth` are readings converted with `start.disparity`. Robust (Ceres, Cauchy); deviations are as
/// large as the residuals say. No infrared picture is needed, but tilted boards are. The scale of everything
/// is that of the board's squares. Errors: fewer than 3 poses, or boards that leave it undetermined.
Result<DisparityFit> fit_disparity_camera(std::span<const DepthPose> poses, const DisparityCamera& start,
                                          const DisparityPrior& prior = {});

}  // namespace hm
