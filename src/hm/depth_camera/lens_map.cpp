#include "hm/depth_camera/lens_map.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace hm {

LensMap::Source LensMap::source_at(const PinholeCamera& camera, const Vec2& place) {
  if (!place.allFinite() || !camera.contains(place)) return {false, 0, 0, 0};
  // The four pixels around the place; at the border the picture is continued by its last row or column.
  const double x = std::clamp(place.x(), 0.0, camera.width - 1.0);
  const double y = std::clamp(place.y(), 0.0, camera.height - 1.0);
  const int left = std::clamp(static_cast<int>(x), 0, std::max(0, camera.width - 2));
  const int top = std::clamp(static_cast<int>(y), 0, std::max(0, camera.height - 2));
  return {true, top * camera.width + left, static_cast<std::uint16_t>(std::lround((x - left) * 256)),
          static_cast<std::uint16_t>(std::lround((y - top) * 256))};
}

std::int32_t LensMap::nearest_at(const PinholeCamera& camera, const Vec2& place) {
  if (!place.allFinite() || !camera.contains(place)) return -1;
  const auto x = std::min(static_cast<int>(std::floor(place.x() + 0.5)), camera.width - 1);
  const auto y = std::min(static_cast<int>(std::floor(place.y() + 0.5)), camera.height - 1);
  return y * camera.width + x;
}

LensMap::LensMap(const PinholeCamera& distorted) : width_(distorted.width), height_(distorted.height) {
  const PinholeCamera ideal = distorted.without_distortion();
  sources_.reserve(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  for (int y = 0; y < height_; ++y) {
    first_run_.push_back(runs_.size());
    for (int x = 0; x < width_; ++x) {
      const Vec2 place = distorted.project(ideal.unproject(Vec2(x, y), 1.0));
      sources_.push_back(source_at(distorted, place));
      add_to_runs(nearest_at(distorted, place), x == 0);
    }
  }
  first_run_.push_back(runs_.size());
}

void LensMap::add_to_runs(std::int32_t source, bool begins_row) {
  const bool goes_on = !begins_row && (source < 0 ? runs_.back().source < 0
                                                  : runs_.back().source >= 0 &&
                                                        source == runs_.back().source + runs_.back().count);
  if (goes_on)
    ++runs_.back().count;
  else
    runs_.push_back({source, 1});
}

void LensMap::undistort_row(const Image<std::uint16_t>& depth, int y, std::uint16_t* row) const {
  // Copies of a fixed size are a load and a store; what they write beyond their run, the next one writes
  // anew.
  constexpr std::int32_t kBlock = kRowSlack_px;
  const auto readable = static_cast<std::int32_t>(depth.size()) - kBlock;
  const std::uint16_t* const pixels = depth.data();
  const auto at = static_cast<std::size_t>(y);
  for (std::size_t i = first_run_[at]; i < first_run_[at + 1]; ++i) {
    const auto [source, count] = runs_[i];
    if (source < 0) {
      std::fill_n(row, count, std::uint16_t{0});
    } else if (source + count > readable) {
      std::copy_n(pixels + source, count, row);
    } else {
      for (std::int32_t x = 0; x < count; x += kBlock)
        std::memcpy(row + x, pixels + source + x, kBlock * sizeof(std::uint16_t));
    }
    row += count;
  }
}

Image<std::uint16_t> LensMap::undistort(const Image<std::uint16_t>& depth) const {
  HM_CHECK(depth.width() == width_ && depth.height() == height_, "{} x {}", depth.width(), depth.height());
  Image<std::uint16_t> result(width_, height_);
  std::vector<std::uint16_t> row(static_cast<std::size_t>(width_ + kRowSlack_px));
  for (int y = 0; y < height_; ++y) {
    undistort_row(depth, y, row.data());
    std::copy_n(row.data(), width_, result.row(y).data());
  }
  return result;
}

Image<Rgb8> LensMap::undistort(const Image<Rgb8>& color) const {
  HM_CHECK(color.width() == width_ && color.height() == height_, "{} x {}", color.width(), color.height());
  Image<Rgb8> result(width_, height_);
  const int right_step = width_ > 1 ? 1 : 0, down_step = height_ > 1 ? width_ : 0;
  for (std::size_t i = 0; i < sources_.size(); ++i) {
    const Source& s = sources_[i];
    if (!s.is_inside) continue;
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
