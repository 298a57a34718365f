#include "hm/slam/laser/search/observed_area.hpp"

#include <algorithm>
#include <cmath>

namespace hm {
namespace {

constexpr double kMaxBeam_m = 200;

bool usable(const SeenBeam& beam) {
  return beam.from_m.allFinite() && beam.to_m.allFinite() && (beam.to_m - beam.from_m).norm() < kMaxBeam_m &&
         beam.from_m.norm() < kMaxBeam_m;
}

}  // namespace

ObservedArea::ObservedArea(std::span<const SeenBeam> beams, double resolution_m)
    : resolution_m_(resolution_m) {
  Vec2 low = Vec2::Constant(1e9), high = -low;
  for (const SeenBeam& beam : beams) {
    if (!usable(beam)) continue;
    low = low.cwiseMin(beam.from_m).cwiseMin(beam.to_m);
    high = high.cwiseMax(beam.from_m).cwiseMax(beam.to_m);
  }
  if (low.x() > high.x()) return;
  low_m_ = low - Vec2::Constant(2 * resolution_m);
  width_ = static_cast<int>((high.x() - low_m_.x()) / resolution_m) + 3;
  height_ = static_cast<int>((high.y() - low_m_.y()) / resolution_m) + 3;
  const auto width = static_cast<std::size_t>(width_), height = static_cast<std::size_t>(height_);
  std::vector<std::uint8_t> seen(width * height, 0);
  for (const SeenBeam& beam : beams) {
    if (!usable(beam)) continue;
    const int steps = static_cast<int>((beam.to_m - beam.from_m).norm() / resolution_m) + 1;
    for (int i = 0; i <= steps; ++i) {
      const Vec2 at = (beam.from_m + (beam.to_m - beam.from_m) * i / steps - low_m_) / resolution_m;
      const auto x = static_cast<std::size_t>(at.x()), y = static_cast<std::size_t>(at.y());
      for (std::size_t row = y - 1; row <= y + 1; ++row)
        for (std::size_t column = x - 1; column <= x + 1; ++column) seen[row * width + column] = 1;
    }
  }
  count_.assign((width + 1) * (height + 1), 0);
  for (std::size_t y = 0; y < height; ++y)
    for (std::size_t x = 0, in_row = 0; x < width; ++x) {
      in_row += seen[y * width + x];
      count_[(y + 1) * (width + 1) + x + 1] =
          count_[y * (width + 1) + x + 1] + static_cast<std::uint32_t>(in_row);
    }
}

bool ObservedArea::contains(const Vec2& point_m) const { return contains(point_m, point_m); }

bool ObservedArea::contains(const Vec2& low_m, const Vec2& high_m) const {
  const Vec2 first = (low_m - low_m_) / resolution_m_, last = (high_m - low_m_) / resolution_m_;
  if (!(first.x() >= 0 && first.y() >= 0 && last.x() < width_ && last.y() < height_)) return false;
  const int left = static_cast<int>(first.x()), right = static_cast<int>(last.x()) + 1;
  const int bottom = static_cast<int>(first.y()), top = static_cast<int>(last.y()) + 1;
  return count_below(right, top) - count_below(left, top) - count_below(right, bottom) +
             count_below(left, bottom) ==
         static_cast<std::uint32_t>((right - left) * (top - bottom));
}

}  // namespace hm
