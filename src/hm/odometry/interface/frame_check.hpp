#pragma once
#include <optional>
#include <string>

#include "hm/geometry/camera.hpp"
#include "hm/sensors/rgbd_frame.hpp"

namespace hm {

/// Why a frame cannot be used (no colour, another size than the camera's, not after the last frame), in
/// words; empty when it can.
std::string reason_to_skip(const RgbdFrame& frame, const PinholeCamera& camera,
                           const std::optional<Time>& last_stamp);

}  // namespace hm
