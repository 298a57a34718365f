#pragma once
#include <optional>
#include <string_view>

#include "hm/depth_camera/depth_correction.hpp"
#include "hm/depth_camera/disparity.hpp"
#include "hm/geometry/camera.hpp"
#include "hm/geometry/se3.hpp"

namespace hm {

/// Camera to which the poses of a recording belong.
enum class PosesOf { kColorCamera, kDepthCamera };
inline constexpr std::string_view kPosesOfNames[] = {"color", "depth"};

/// Calibration of a depth camera with its colour camera (dissertation 3.1). Readers apply the parts that are
/// set, in this order: disparity to depth, rectification, depth correction, registration to the colour
/// camera.
///
/// Without a depth camera, depth images are assumed to be registered by the device: both images have the
/// colour camera's geometry.
struct RgbdCalibration {
  std::optional<PinholeCamera> depth_camera;  ///< the infrared camera
  std::optional<PinholeCamera> color_camera;
  std::optional<SE3> T_color_depth;                      ///< p_color = T_color_depth * p_depth
  std::optional<DisparityModel> disparity;               ///< set when depth images hold raw disparity
  std::optional<DepthCorrectionModel> depth_correction;  ///< of rectified depth, before registration
  PosesOf poses_of = PosesOf::kColorCamera;

  /// True when depth images can be registered to the colour camera.
  [[nodiscard]] bool registers_depth() const { return depth_camera && color_camera && T_color_depth; }
};

}  // namespace hm
