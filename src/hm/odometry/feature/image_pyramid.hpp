#pragma once
#include <cstdint>
#include <vector>

#include "hm/geometry/image.hpp"
#include "hm/geometry/se3.hpp"

namespace hm {

/// Image pyramid of a grey image, each level half the size (means of 2x2 pixels). Level 0 is the image
/// itself.
class ImagePyramid {
 public:
  ImagePyramid() = default;
  ImagePyramid(Image<std::uint8_t> gray, int levels);

  [[nodiscard]] int levels() const { return static_cast<int>(levels_.size()); }
  [[nodiscard]] const Image<std::uint8_t>& level(int index) const {
    return levels_[static_cast<std::size_t>(index)];
  }
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  std::vector<Image<std::uint8_t>> levels_;
};

/// Converts a pixel of level 0 to a level and back; the centre of the first pixel of level l is at (2^l - 1)
/// / 2.
inline Vec2 pixel_in_level(const Vec2& pixel, int level) {
  const double scale = 1.0 / (1 << level);
  return (pixel + Vec2::Constant(0.5)) * scale - Vec2::Constant(0.5);
}
inline Vec2 pixel_from_level(const Vec2& pixel, int level) {
  return (pixel + Vec2::Constant(0.5)) * (1 << level) - Vec2::Constant(0.5);
}

}  // namespace hm
