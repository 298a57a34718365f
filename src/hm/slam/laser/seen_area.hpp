#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "hm/geometry/se2.hpp"

namespace hm {

/// A beam from the laser to what it hit, in the frame of a map.
struct SeenBeam {
  Vec2 from_m, to_m;
};

/// Where a map was looked at: cells that beams pass or end in, and their neighbours. What a scan sees
/// elsewhere speaks neither for nor against a place.
class SeenArea {
 public:
  explicit SeenArea(std::span<const SeenBeam> beams, double resolution_m = 0.2);
  [[nodiscard]] bool contains(const Vec2& point_m) const;

 private:
  double resolution_m_;
  Vec2 low_m_ = Vec2::Zero();
  int width_ = 0, height_ = 0;
  std::vector<std::uint8_t> seen_;
};

}  // namespace hm
