#include "hm/odometry/feature/image_pyramid.hpp"

namespace hm {
namespace {

Image<std::uint8_t> halved(const Image<std::uint8_t>& image) {
  Image<std::uint8_t> half(image.width() / 2, image.height() / 2);
  for (int y = 0; y < half.height(); ++y) {
    const std::uint8_t* upper = image.row(2 * y).data();
    const std::uint8_t* lower = image.row(2 * y + 1).data();
    std::uint8_t* out = half.row(y).data();
    const int width = half.width();
    for (int x = 0; x < width; ++x) {
      const int sum = upper[2 * x] + upper[2 * x + 1] + lower[2 * x] + lower[2 * x + 1];
      out[x] = static_cast<std::uint8_t>((sum + 2) >> 2);
    }
  }
  return half;
}

}  // namespace

ImagePyramid::ImagePyramid(Image<std::uint8_t> gray, int levels) {
  HM_CHECK(levels >= 1, "{} levels", levels);
  levels_.push_back(std::move(gray));
  while (static_cast<int>(levels_.size()) < levels) levels_.push_back(halved(levels_.back()));
}

std::size_t ImagePyramid::memory_bytes() const {
  std::size_t bytes = 0;
  for (const auto& image : levels_) bytes += image.size() + sizeof(image) + 16;
  return bytes;
}

}  // namespace hm
