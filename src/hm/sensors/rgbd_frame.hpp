#pragma once
#include <cstdint>
#include <optional>

#include "hm/core/time.hpp"
#include "hm/geometry/camera.hpp"
#include "hm/geometry/image.hpp"
#include "hm/geometry/se3.hpp"

namespace hm {

/// A depth image as sensors deliver it: distance along the optical axis (z) in whole units of `unit_m`
/// metres. 0 means no reading; readers turn every other marker (65535 ...) into 0.
struct DepthImage {
  Image<std::uint16_t> units;
  double unit_m = 1e-3;

  [[nodiscard]] int width() const { return units.width(); }
  [[nodiscard]] int height() const { return units.height(); }
  /// Metres at a pixel; 0 for no reading.
  [[nodiscard]] double depth_m(int x, int y) const { return units(x, y) * unit_m; }
};

/// One depth image with its colour image (registered to it, same size; empty when there is none) and
/// the pose of the camera at the moment of the depth image, if known.
struct RgbdFrame {
  std::size_t index = 0;  ///< position in the recording
  Time stamp;             ///< of the depth image
  Time color_stamp;
  DepthImage depth;
  Image<Rgb8> color;
  std::optional<SE3> T_world_camera;
};

/// A frame at a pose, which need not be the frame's own. Valid while the frame is.
struct PosedFrame {
  const RgbdFrame& frame;
  SE3 T_world_camera;
};

}  // namespace hm
