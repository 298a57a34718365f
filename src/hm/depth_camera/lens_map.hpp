#pragma once
#include <cstdint>
#include <vector>

#include "hm/geometry/camera.hpp"
#include "hm/geometry/image.hpp"

namespace hm {

/// Removes lens distortion with a lookup table: for every pixel of the ideal camera (same size, focal lengths
/// and principal point) the position in the distorted image that sees the same ray. Depth takes the nearest
/// pixel, since depth must not be interpolated across edges; colour is interpolated bilinearly (8-bit
/// weights). Pixels without a source become 0. Const members are thread-safe.
class LensMap {
 public:
  explicit LensMap(const PinholeCamera& distorted);
  [[nodiscard]] Image<std::uint16_t> undistort(const Image<std::uint16_t>& depth) const;
  /// The same into an existing image, whose memory is reused when it has the same size.
  void undistort(const Image<std::uint16_t>& depth, Image<std::uint16_t>& rectified) const;
  [[nodiscard]] Image<Rgb8> undistort(const Image<Rgb8>& color) const;

 private:
  struct Source {
    std::int32_t upper_left;            ///< index of the upper left of the four surrounding pixels
    std::uint16_t right_256, down_256;  ///< weights of the right and the lower pixels
  };
  [[nodiscard]] static Source source_at(const PinholeCamera& camera, const Vec2& place);
  int width_;
  int height_;
  std::vector<std::int32_t> nearest_;  ///< index of the nearest pixel; -1: outside
  std::vector<Source> sources_;        ///< of pixels whose nearest_ is not -1
};

}  // namespace hm
