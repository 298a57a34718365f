#pragma once
#include <cstddef>

#include "hm/core/result.hpp"
#include "hm/geometry/camera.hpp"
#include "hm/sensors/rgbd_frame.hpp"

namespace hm {

/// Random access to RGB-D frames, for code that needs a frame again after it has been processed, e.g. to
/// rebuild a map after a loop closure has corrected its poses. Implemented by recordings and by FrameArchive
/// (in memory); callers with their own storage can implement it too.
class FrameSource {
 public:
  virtual ~FrameSource() = default;
  /// Camera of the frames returned by read(): without lens distortion, of the images' size.
  [[nodiscard]] virtual PinholeCamera camera() const = 0;
  /// Reads the frame with this index, decoded and undistorted; bit-identical every time. Must be safe to call
  /// from several threads at once. An error names what could not be read; other frames are not affected.
  [[nodiscard]] virtual Result<RgbdFrame> read(std::size_t index) const = 0;
  /// The same without colour, where reading it takes time; then no error where only colour cannot be read.
  [[nodiscard]] virtual Result<RgbdFrame> read_depth(std::size_t index) const { return read(index); }
};

}  // namespace hm
