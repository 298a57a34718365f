#pragma once
#include <chrono>
#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "hm/core/result.hpp"

namespace hm {

/// The system calls of a video device (V4L2), so that something else than the kernel can answer them.
class VideoDevice {
 public:
  virtual ~VideoDevice() = default;
  /// ioctl(): the request and its argument as in linux/videodev2.h. -1 with errno on failure.
  virtual int control(unsigned long request, void* argument) = 0;
  /// read(): bytes read, 0 at the end, -1 with errno.
  virtual long read(std::span<std::byte> bytes) = 0;
  /// mmap() of a buffer that the device writes into; stays valid until the device is destroyed. Empty on
  /// failure.
  virtual std::span<const std::byte> map(std::size_t length, std::size_t offset) = 0;
  /// To poll() for input.
  [[nodiscard]] virtual int descriptor() const = 0;
  /// Path, for messages.
  [[nodiscard]] virtual std::string name() const = 0;
};

/// Opens a device of the kernel ("/dev/video0"). Error: it cannot be opened, with the reason.
Result<std::unique_ptr<VideoDevice>> open_video_device(const std::string& path);
/// Paths of the video devices of this computer, in order of their numbers.
std::vector<std::string> video_device_paths();

/// Which of two devices has input, waiting up to `timeout` for one: a device whose end came has input too.
struct VideoInput {
  bool first = false, second = false;
};
VideoInput wait_for_input(const VideoDevice& first, const VideoDevice& second,
                          std::chrono::milliseconds timeout);

}  // namespace hm
