#include "hm/report/render/axis_ticks.hpp"

#include <cmath>

namespace hm {

std::vector<double> nice_ticks(double min, double max, int wanted) {
  std::vector<double> ticks;
  if (!std::isfinite(min) || !std::isfinite(max) || !(max > min) || wanted < 1) return ticks;
  const double raw = (max - min) / wanted;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  double step = 10 * power;
  for (const double factor : {1.0, 2.0, 5.0})
    if (raw <= 1.3 * factor * power) {
      step = factor * power;
      break;
    }
  // Counted, so that rounding does not add up.
  const double first = std::ceil(min / step - 1e-9), last = std::floor(max / step + 1e-9);
  for (double k = first; k <= last; k += 1) ticks.push_back(k * step + 0.0);  // no -0
  return ticks;
}

}  // namespace hm
