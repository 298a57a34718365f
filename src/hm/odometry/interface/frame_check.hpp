#pragma once
#include <optional>
#include <string>

#include "hm/geometry/camera.hpp"
#include "hm/sensors/rgbd_frame.hpp"

namespace hm {

/// Whether a method can use a frame without a colour image.
enum class ColorNeed { kAlways, kIfPresent };

/// Reason why a frame cannot be used (no colour, size different from the camera's, not later than the last
/// frame); empty when it can.
std::string reason_to_skip(const RgbdFrame& frame, const PinholeCamera& camera,
                           const std::optional<Time>& last_stamp, ColorNeed need = ColorNeed::kAlways);

}  // namespace hm
