#include "hm/cameras/yuv.hpp"

#include <algorithm>

#include "hm/core/check.hpp"

namespace hm {
namespace {

std::uint8_t clamped(int value) { return static_cast<std::uint8_t>(std::clamp(value, 0, 255)); }

/// In units of 1 / 65536, rounded: with Y' = 1.164383 (Y - 16), R = Y' + 1.596027 V,
/// G = Y' - 0.391762 U - 0.812968 V, B = Y' + 2.017232 U.
Rgb8 to_rgb(int y, int u, int v) {
  constexpr int kHalf = 1 << 15, kShift = 16;
  const int luma = 76309 * (y - 16) + kHalf;
  return {clamped((luma + 104597 * v) >> kShift), clamped((luma - 25675 * u - 53279 * v) >> kShift),
          clamped((luma + 132201 * u) >> kShift)};
}

}  // namespace

Image<Rgb8> yuyv_to_rgb(std::span<const std::byte> bytes, int width, int height, std::size_t row_bytes) {
  HM_CHECK(width % 2 == 0 && row_bytes >= 2 * static_cast<std::size_t>(width) &&
               bytes.size() + row_bytes >=
                   static_cast<std::size_t>(height) * row_bytes + 2 * static_cast<std::size_t>(width),
           "{} bytes of {} x {}, rows of {}", bytes.size(), width, height, row_bytes);
  Image<Rgb8> image(width, height);
  for (int row = 0; row < height; ++row) {
    const std::byte* in = bytes.data() + static_cast<std::size_t>(row) * row_bytes;
    Rgb8* out = image.row(row).data();
    for (int x = 0; x < width; x += 2, in += 4, out += 2) {
      const int u = std::to_integer<int>(in[1]) - 128, v = std::to_integer<int>(in[3]) - 128;
      out[0] = to_rgb(std::to_integer<int>(in[0]), u, v);
      out[1] = to_rgb(std::to_integer<int>(in[2]), u, v);
    }
  }
  return image;
}

}  // namespace hm
