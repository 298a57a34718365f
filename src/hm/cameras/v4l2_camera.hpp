#pragma once
#include <memory>
#include <string>
#include <vector>

#include "hm/cameras/camera_driver.hpp"
#include "hm/cameras/video_device.hpp"

namespace hm {

/// The two devices of a depth camera with a V4L2 driver of the kernel, such as Intel RealSense: one gives
/// depth (Z16), one colour (YUYV or MJPEG).
struct VideoDevices {
  std::unique_ptr<VideoDevice> depth, color;
};

/// A depth camera of two video devices. V4L2 gives no intrinsics: the request has a calibration, or
/// intrinsics for images that are registered. Images come by mmap() buffers, or by read() where the device
/// has no buffers. Exposure and white balance are locked after a second. Errors: kUsage without intrinsics; a
/// device that has no such format, or refuses a setting.
Result<std::unique_ptr<CameraDriver>> open_v4l2(VideoDevices devices, const CameraRequest& request);
/// The same of the kernel's devices: "DEPTH,COLOR" ("/dev/video2,/dev/video4"); empty takes the first depth
/// device and the colour device of the same camera.
Result<std::unique_ptr<CameraDriver>> open_v4l2(const std::string& device, const CameraRequest& request);
/// Pairs of devices that are plugged in, as open_v4l2() takes them.
std::vector<std::string> list_v4l2();

}  // namespace hm
