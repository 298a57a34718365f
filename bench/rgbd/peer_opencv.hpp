#pragma once
#include <memory>

#include "hm/sensors/rgbd_frame.hpp"

namespace hm::bench {

/// OpenCV's dense odometries of the module rgbd, with their default parameters: photometric (Steinbruecker et
/// al. 2011), and photometric with point-to-plane ICP.
enum class OpencvMethod { kRgbd, kRgbdIcp };

/// One of them, each frame against the one before. One thread.
class OpencvOdometry {
 public:
  OpencvOdometry(OpencvMethod method, const PinholeCamera& camera);
  ~OpencvOdometry();

  /// The pose of the frame in the camera of the first one; where OpenCV gives none, that of the frame before.
  SE3 track(const RgbdFrame& frame);
  [[nodiscard]] int failures() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm::bench
