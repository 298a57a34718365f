#pragma once
#include <cstdint>

#include "hm/geometry/camera.hpp"
#include "hm/geometry/image.hpp"
#include "hm/geometry/se3.hpp"

namespace hm {

/// Brings depth images into the view of another camera: every reading goes to the nearest pixel (rounded, not
/// cut) that sees its point, the nearest reading wins, and holes of one pixel between readings that agree are
/// filled (dissertation 3.1.2). Const members may be used from any thread.
class DepthRegistration {
 public:
  /// Both cameras without distortion; T_color_depth takes points of the depth camera into the colour camera.
  DepthRegistration(const PinholeCamera& depth_camera, const PinholeCamera& color_camera,
                    const SE3& T_color_depth);
  /// Depth along the colour camera's axis, of its size, in the same units.
  [[nodiscard]] Image<std::uint16_t> apply(const Image<std::uint16_t>& depth, double unit_m) const;

 private:
  PinholeCamera depth_camera_, color_camera_;
  SE3 T_color_depth_;
};

}  // namespace hm
