#pragma once
#include <string>
#include <vector>

#include "hm/report/plot.hpp"

namespace hm {

/// Map from axis values to pixels; internal to this room.
class AxisMap {
 public:
  /// Maps [min, max] to [low_px, high_px]. On a log scale min must be positive.
  AxisMap(const PlotAxis& axis, double min, double max, double low_px, double high_px);
  /// Pixel of a value; NaN if it cannot be shown on this scale.
  [[nodiscard]] double at(double value) const;
  [[nodiscard]] bool shows(double value) const { return value >= min_ && value <= max_; }
  /// Tick positions with their texts.
  [[nodiscard]] std::vector<std::pair<double, std::string>> ticks(int wanted) const;
  [[nodiscard]] double min() const { return min_; }
  [[nodiscard]] double max() const { return max_; }

 private:
  AxisScale scale_;
  double min_, max_, low_px_, high_px_;
};

/// Range that includes all drawable values (or the axis' own range); valid even without values.
std::pair<double, double> axis_range(const PlotAxis& axis, const std::vector<double>& values, bool from_zero);

}  // namespace hm
