#include "hm/depth_camera/lens_map.hpp"

#include <algorithm>
#include <cmath>

namespace hm {

LensMap::Source LensMap::source_at(const PinholeCamera& camera, const Vec2& place) {
  // The four pixels around the position; at the border the last row or column is repeated.
  const double x = std::clamp(place.x(), 0.0, camera.width - 1.0);
  const double y = std::clamp(place.y(), 0.0, camera.height - 1.0);
  const int left = std::clamp(static_cast<int>(x), 0, std::max(0, camera.width - 2));
  const int top = std::clamp(static_cast<int>(y), 0, std::max(0, camera.height - 2));
  return {top * camera.width + left, static_cast<std::uint16_t>(std::lround((x - left) * 256)),
          static_cast<std::uint16_t>(std::lround((y - top) * 256))};
}

LensMap::LensMap(const PinholeCamera& distorted) : width_(distorted.width), height_(distorted.height) {
  const PinholeCamera ideal = distorted.without_distortion();
  const std::size_t size = static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
  nearest_.reserve(size);
  sources_.reserve(size);
  for (int y = 0; y < height_; ++y)
    for (int x = 0; x < width_; ++x) {
      const Vec2 place = distorted.project(ideal.unproject(Vec2(x, y), 1.0));
      if (!place.allFinite() || !distorted.contains(place)) {
        nearest_.push_back(-1);
        sources_.push_back({});
        continue;
      }
      const int column = std::min(static_cast<int>(std::floor(place.x() + 0.5)), width_ - 1);
      const int row = std::min(static_cast<int>(std::floor(place.y() + 0.5)), height_ - 1);
      nearest_.push_back(row * width_ + column);
      sources_.push_back(source_at(distorted, place));
    }
}

void LensMap::undistort(const Image<std::uint16_t>& depth, Image<std::uint16_t>& rectified) const {
  HM_CHECK(depth.width() == width_ && depth.height() == height_, "{} x {}", depth.width(), depth.height());
  HM_CHECK(&depth != &rectified, "two images are needed");
  if (rectified.width() != width_ || rectified.height() != height_)
    rectified = Image<std::uint16_t>(width_, height_);
  const std::uint16_t* const from = depth.data();
  std::uint16_t* const to = rectified.data();
  for (std::size_t i = 0; i < nearest_.size(); ++i)
    to[i] = nearest_[i] < 0 ? std::uint16_t{0} : from[nearest_[i]];
}

Image<std::uint16_t> LensMap::undistort(const Image<std::uint16_t>& depth) const {
  Image<std::uint16_t> rectified;
  undistort(depth, rectified);
  return rectified;
}

Image<Rgb8> LensMap::undistort(const Image<Rgb8>& color) const {
  HM_CHECK(color.width() == width_ && color.height() == height_, "{} x {}", color.width(), color.height());
  Image<Rgb8> result(width_, height_);
  const int right_step = width_ > 1 ? 1 : 0, down_step = height_ > 1 ? width_ : 0;
  for (std::size_t i = 0; i < sources_.size(); ++i) {
    if (nearest_[i] < 0) continue;
    const Source& s = sources_[i];
    const Rgb8* upper = color.data() + s.upper_left;
    const Rgb8* lower = upper + down_step;
    const std::uint32_t right = s.right_256, left = 256 - right, down = s.down_256, up = 256 - down;
    const auto mix = [&](std::uint8_t Rgb8::*channel) {
      const std::uint32_t sum = up * (left * (upper->*channel) + right * ((upper + right_step)->*channel)) +
                                down * (left * (lower->*channel) + right * ((lower + right_step)->*channel));
      return static_cast<std::uint8_t>((sum + 32768) >> 16);
    };
    result.data()[i] = {mix(&Rgb8::r), mix(&Rgb8::g), mix(&Rgb8::b)};
  }
  return result;
}

}  // namespace hm
