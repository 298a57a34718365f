#include "hm/calibration/depth_average.hpp"

#include <cmath>

namespace hm {

DepthAverage::DepthAverage(int width, int height)
    : mean_m_(width, height), squares_(width, height), count_(width, height) {}

void DepthAverage::add(const DepthImage& depth) {
  HM_CHECK(depth.width() == width() && depth.height() == height(), "{} x {}", depth.width(), depth.height());
  ++images_;
  for (std::size_t i = 0; i < depth.units.size(); ++i) {
    const std::uint16_t units = depth.units.data()[i];
    if (units == 0) continue;  // 0: no reading
    const double z = units * depth.unit_m, before = z - mean_m_.data()[i];
    mean_m_.data()[i] += before / ++count_.data()[i];
    squares_.data()[i] += before * (z - mean_m_.data()[i]);
  }
}

double DepthAverage::sigma_m(int x, int y) const {
  const int n = count_(x, y);
  return n < 2 ? 0.0 : std::sqrt(squares_(x, y) / (n - 1));
}

}  // namespace hm
