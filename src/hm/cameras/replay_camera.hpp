#pragma once
#include <memory>
#include <string>

#include "hm/cameras/camera_driver.hpp"

namespace hm {

/// A recording as a camera: its frames come at its own pace, times CameraRequest::replay_speed, with its own
/// stamps, from the first one after CameraRequest::after. Frames that cannot be read are incomplete ones.
/// Errors: those of open_recording().
Result<std::unique_ptr<CameraDriver>> open_replay(const std::string& recording, const CameraRequest& request);

}  // namespace hm
