#include "hm/report/plot_axis.hpp"
#include "hm/report/render/axis_ticks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace hm {
namespace {

std::string number_text(double value, double step) {
  if (std::abs(value) < 1e-9 * step) value = 0;
  const double size = std::max(std::abs(value), step);
  if (size >= 1e6 || step < 1e-4) return fmt::format("{:.3g}", value);
  const int digits = static_cast<int>(std::clamp(std::ceil(-std::log10(step) - 1e-9), 0.0, 5.0));
  return fmt::format("{:.{}f}", value, digits);
}

}  // namespace

AxisMap::AxisMap(const PlotAxis& axis, double min, double max, double low_px, double high_px)
    : scale_(axis.scale), min_(min), max_(max), low_px_(low_px), high_px_(high_px) {}

double AxisMap::at(double value) const {
  double share = (value - min_) / (max_ - min_);
  if (scale_ == AxisScale::kLog)
    share =
        value > 0 ? std::log(value / min_) / std::log(max_ / min_) : std::numeric_limits<double>::quiet_NaN();
  if (!std::isfinite(share)) return std::numeric_limits<double>::quiet_NaN();
  return low_px_ + std::clamp(share, -10.0, 11.0) * (high_px_ - low_px_);
}

std::vector<std::pair<double, std::string>> AxisMap::ticks(int wanted) const {
  std::vector<std::pair<double, std::string>> out;
  if (scale_ == AxisScale::kLog) {
    const double decades = std::log10(max_ / min_);
    const std::vector<double> factors = decades > 3 ? std::vector<double>{1} : std::vector<double>{1, 2, 5};
    const int every = std::max(1, static_cast<int>(std::ceil(decades / (2 * wanted))));
    const int first = static_cast<int>(std::floor(std::log10(min_))),
              last = static_cast<int>(std::ceil(std::log10(max_)));
    for (int decade = first; decade <= last; decade += every)
      for (const double factor : factors) {
        const double value = factor * std::pow(10.0, decade);
        if (value >= min_ * (1 - 1e-9) && value <= max_ * (1 + 1e-9))
          out.emplace_back(value, fmt::format("{:g}", value));
      }
    return out;
  }
  const std::vector<double> values = nice_ticks(min_, max_, wanted);
  const double step = values.size() > 1 ? values[1] - values[0] : std::max(std::abs(max_), 1e-9);
  for (const double value : values) out.emplace_back(value, number_text(value, step));
  return out;
}

std::pair<double, double> axis_range(const PlotAxis& axis, const std::vector<double>& values,
                                     bool from_zero) {
  const bool log = axis.scale == AxisScale::kLog;
  if (axis.max > axis.min && (!log || axis.min > 0)) return {axis.min, axis.max};
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const double v : values) {
    if (!std::isfinite(v) || (log && v <= 0)) continue;
    low = std::min(low, v);
    high = std::max(high, v);
  }
  if (!(low <= high)) return log ? std::pair{0.1, 10.0} : std::pair{0.0, 1.0};
  if (log) return {low / 1.15, high * 1.15};
  if (from_zero && low >= 0) low = 0;
  const double span = std::max({high - low, 1e-9 * std::abs(high), 1e-12});
  const bool flat = high - low <= 1e-12 * std::abs(high);
  if (flat) return {low - std::max(0.5, 0.1 * std::abs(low)), high + std::max(0.5, 0.1 * std::abs(high))};
  return {from_zero && low == 0 ? 0 : low - 0.03 * span, high + 0.06 * span};
}

}  // namespace hm
