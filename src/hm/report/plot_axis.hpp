#pragma once
#include <string>
#include <vector>

#include "hm/report/plot.hpp"

namespace hm {

/// A stretch of pixels that shows a range of values; internal to this room.
class AxisMap {
 public:
  /// `low_px` shows `min`. On a log scale min must be positive.
  AxisMap(const PlotAxis& axis, double min, double max, double low_px, double high_px);
  /// Pixels; NaN for a value that cannot be shown on this scale.
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

/// The range that shows all values that the axis can show (or the axis' own); a usable one even for none.
std::pair<double, double> axis_range(const PlotAxis& axis, const std::vector<double>& values, bool from_zero);

}  // namespace hm
