#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "hm/geometry/se2.hpp"

namespace hm {

/// Laser beam from the sensor to its endpoint, in the frame of a map.
struct SeenBeam {
  Vec2 from_m, to_m;
};

/// Area of a map that was observed: cells that beams pass or end in, and their neighbours. Scan points
/// outside it are ignored when poses are compared.
class ObservedArea {
 public:
  explicit ObservedArea(std::span<const SeenBeam> beams, double resolution_m = 0.2);
  [[nodiscard]] bool contains(const Vec2& point_m) const;
  /// Whether all of a rectangle was observed; `low_m` must not exceed `high_m`.
  [[nodiscard]] bool contains(const Vec2& low_m, const Vec2& high_m) const;

 private:
  [[nodiscard]] std::uint32_t count_below(int x, int y) const {
    return count_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_ + 1) +
                  static_cast<std::size_t>(x)];
  }

  double resolution_m_;
  Vec2 low_m_ = Vec2::Zero();
  int width_ = 0, height_ = 0;
  /// Number of observed cells with both indices less than these (summed-area table), (width + 1) x (height +
  /// 1).
  std::vector<std::uint32_t> count_;
};

}  // namespace hm
