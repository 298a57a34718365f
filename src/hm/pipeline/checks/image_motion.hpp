#pragma once
#include <optional>

#include "hm/geometry/camera.hpp"
#include "hm/sensors/rgbd_frame.hpp"

namespace hm {

/// Motion of a colour image, warped by depth and poses into another camera, that fits it to that camera's
/// image.
struct ImageMotion {
  double turn_rad = 0;           ///< about the optical axis
  Vec2 shift_px = Vec2::Zero();  ///< after it
  double likeness = 0;           ///< correlation of the brightness with this motion, at most 1
  double unmoved_likeness = 0;   ///< without it

  /// The larger of turn and shift, as an angle at the camera.
  [[nodiscard]] double angle_rad(const PinholeCamera& camera) const;
};

/// Searches turns of up to 12 degrees and shifts of up to 0.15 of the image's width, in steps of 1.5 degrees
/// and an eightieth of the width; beyond, the likeness is low. Both frames have poses; `camera` has no
/// distortion. None where a frame has no colour or one of another size than the camera, or where they share
/// too little.
std::optional<ImageMotion> image_motion(const RgbdFrame& from, const RgbdFrame& to,
                                        const PinholeCamera& camera);

}  // namespace hm
