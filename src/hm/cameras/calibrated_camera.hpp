#pragma once
#include <memory>

#include "hm/cameras/camera_driver.hpp"
#include "hm/depth_camera/rgbd_calibration.hpp"

namespace hm {

/// A camera whose images are calibrated (FrameCalibration) before they are delivered. Error: the calibration
/// does not fit the images.
Result<std::unique_ptr<CameraDriver>> calibrate_camera(std::unique_ptr<CameraDriver> camera,
                                                       const RgbdCalibration& calibration);

}  // namespace hm
