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
  seen_.assign(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_), 0);
  for (const SeenBeam& beam : beams) {
    if (!usable(beam)) continue;
    const int steps = static_cast<int>((beam.to_m - beam.from_m).norm() / resolution_m) + 1;
    for (int i = 0; i <= steps; ++i) {
      const Vec2 at = (beam.from_m + (beam.to_m - beam.from_m) * i / steps - low_m_) / resolution_m;
      const int x = static_cast<int>(at.x()), y = static_cast<int>(at.y());
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx)
          seen_[static_cast<std::size_t>(y + dy) * static_cast<std::size_t>(width_) +
                static_cast<std::size_t>(x + dx)] = 1;
    }
  }
}

bool ObservedArea::contains(const Vec2& point_m) const {
  const Vec2 at = (point_m - low_m_) / resolution_m_;
  if (!(at.x() >= 0 && at.y() >= 0 && at.x() < width_ && at.y() < height_)) return false;
  return seen_[static_cast<std::size_t>(at.y()) * static_cast<std::size_t>(width_) +
               static_cast<std::size_t>(at.x())] != 0;
}

}  // namespace hm
