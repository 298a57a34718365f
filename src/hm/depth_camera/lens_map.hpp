#pragma once
#include <cstdint>
#include <vector>

#include "hm/geometry/camera.hpp"
#include "hm/geometry/image.hpp"

namespace hm {

/// Removes lens distortion: for every pixel of the ideal camera (same size, focal lengths and centre) the
/// place in the distorted picture that sees the same ray, computed once. Depth takes the nearest pixel, since
/// depths on two sides of an edge have no mean; colour is interpolated (8-bit weights). Pixels that see
/// nothing become 0. Const members may be used from any thread.
class LensMap {
 public:
  explicit LensMap(const PinholeCamera& distorted);
  [[nodiscard]] Image<std::uint16_t> undistort(const Image<std::uint16_t>& depth) const;
  /// Undistorts into an image that is given, whose memory is used again where it has the same size.
  void undistort(const Image<std::uint16_t>& depth, Image<std::uint16_t>& rectified) const;
  [[nodiscard]] Image<Rgb8> undistort(const Image<Rgb8>& color) const;

 private:
  struct Source {
    std::int32_t upper_left;            ///< index of the upper left one of the four around the place
    std::uint16_t right_256, down_256;  ///< weights of the right and the lower pixels
  };
  [[nodiscard]] static Source source_at(const PinholeCamera& camera, const Vec2& place);
  int width_;
  int height_;
  std::vector<std::int32_t> nearest_;  ///< index of the pixel nearest to the place; -1: outside
  std::vector<Source> sources_;        ///< of pixels whose nearest_ is not -1
};

}  // namespace hm
