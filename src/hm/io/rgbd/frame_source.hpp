#pragma once
#include <cstddef>

#include "hm/core/result.hpp"
#include "hm/geometry/camera.hpp"
#include "hm/sensors/rgbd_frame.hpp"

namespace hm {

/// RGB-D frames by number, for whatever needs a frame again after it has been processed: a map whose poses a
/// loop has corrected is made from the frames once more. Recordings are one; a caller with its own store
/// (a ring on disk, a camera's recorder) implements another; FrameArchive keeps frames in memory.
class FrameSource {
 public:
  virtual ~FrameSource() = default;
  /// The camera of the frames as read() gives them: without lens distortion, of the pictures' size.
  [[nodiscard]] virtual PinholeCamera camera() const = 0;
  /// Reads the frame with this number, pictures decoded and free of lens distortion: the same bits every
  /// time. Called from several threads at the same time. An Error names what could not be read; other frames
  /// are not affected.
  [[nodiscard]] virtual Result<RgbdFrame> read(std::size_t index) const = 0;
};

}  // namespace hm
