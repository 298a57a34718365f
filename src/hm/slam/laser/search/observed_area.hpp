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

 private:
  double resolution_m_;
  Vec2 low_m_ = Vec2::Zero();
  int width_ = 0, height_ = 0;
  std::vector<std::uint8_t> seen_;
};

}  // namespace hm
