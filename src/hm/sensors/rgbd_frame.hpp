#pragma once
#include <cstdint>
#include <optional>

#include "hm/core/time.hpp"
#include "hm/geometry/camera.hpp"
#include "hm/geometry/image.hpp"
#include "hm/geometry/se3.hpp"

namespace hm {

/// Depth image: distance along the optical axis (z) as integers in units of `unit_m` metres. 0 means no
/// reading; readers convert every other marker (65535 ...) to 0.
struct DepthImage {
  Image<std::uint16_t> units;
  double unit_m = 1e-3;

  [[nodiscard]] int width() const { return units.width(); }
  [[nodiscard]] int height() const { return units.height(); }
  /// Depth at a pixel in metres; 0 for no reading.
  [[nodiscard]] double depth_m(int x, int y) const { return units(x, y) * unit_m; }
};

/// Depth image with its colour image (registered to it, same size; empty if none) and the camera pose at the
/// time of the depth image, if known.
struct RgbdFrame {
  std::size_t index = 0;  ///< position in the recording
  Time stamp;             ///< of the depth image
  Time color_stamp;
  DepthImage depth;
  Image<Rgb8> color;
  std::optional<SE3> T_world_camera;
};

/// Frame with a pose, which may differ from the frame's own. Refers to the frame, which must outlive it.
struct PosedFrame {
  const RgbdFrame& frame;
  SE3 T_world_camera;
};

}  // namespace hm
