#pragma once
#include <optional>
#include <string_view>

#include "hm/depth_camera/depth_correction.hpp"
#include "hm/depth_camera/disparity.hpp"
#include "hm/geometry/camera.hpp"
#include "hm/geometry/se3.hpp"

namespace hm {

/// Whose poses a recording gives.
enum class PosesOf { kColorCamera, kDepthCamera };
inline constexpr std::string_view kPosesOfNames[] = {"color", "depth"};

/// What is known of a depth camera with its colour camera (dissertation 3.1). Readers apply what is there, in
/// this order: turn raw disparity into depth, rectify both pictures, correct the depth, register it to the
/// colour camera.
///
/// Without a depth camera, depth pictures are taken as registered by the device: both pictures have the
/// colour camera's geometry.
struct RgbdCalibration {
  std::optional<PinholeCamera> depth_camera;  ///< the infrared camera
  std::optional<PinholeCamera> color_camera;
  std::optional<SE3> T_color_depth;                      ///< depth camera into colour camera
  std::optional<DisparityModel> disparity;               ///< where depth pictures hold raw disparity
  std::optional<DepthCorrectionModel> depth_correction;  ///< of rectified depth, before registration
  PosesOf poses_of = PosesOf::kColorCamera;

  /// True when depth pictures can be brought into the colour camera.
  [[nodiscard]] bool registers_depth() const { return depth_camera && color_camera && T_color_depth; }
};

}  // namespace hm
