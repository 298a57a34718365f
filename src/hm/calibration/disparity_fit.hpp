#pragma once
#include <span>

#include "hm/calibration/depth_refine.hpp"
#include "hm/depth_camera/disparity.hpp"

namespace hm {

/// Depth camera with raw disparity output, and its extrinsics to a colour camera.
struct DisparityCamera {
  PinholeCamera camera;  ///< without distortion
  SE3 T_color_depth;
  DisparityModel disparity;
};

/// Nominal parameters of the first Kinect, 640 x 480: its driver's focal length (575.8 px), the image centre,
/// a baseline of 25 mm to the colour camera, OpenKinect's disparity constants.
DisparityCamera nominal_kinect();

/// Prior standard deviations of the intrinsics and extrinsics.
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

/// Fits the two disparity constants, the depth camera's focal lengths and principal point and the extrinsics,
/// from boards whose poses are known from the colour camera: disparity is linear in the inverse depth of the
/// board's plane (Herrera, Kannala and Heikkila 2012, without disparity distortion). `poses[i].depth` are
/// readings converted with `start.disparity`. Robust (Ceres, Cauchy loss); standard deviations are scaled by
/// the residuals. Needs tilted boards, but no infrared images; the scale comes from the board's squares.
/// Errors: fewer than 3 poses, or an undetermined problem.
Result<DisparityFit> fit_disparity_camera(std::span<const DepthPose> poses, const DisparityCamera& start,
                                          const DisparityPrior& prior = {});

}  // namespace hm
