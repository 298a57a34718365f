#include "hm/core/statistics.hpp"

#include <algorithm>
#include <cmath>

namespace hm {
namespace {

double sorted_quantile(std::span<const double> sorted, double q) {
  if (sorted.empty()) return 0.0;
  const double position = std::clamp(q, 0.0, 1.0) * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(position);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  const double fraction = position - static_cast<double>(below);
  return sorted[below] + fraction * (sorted[above] - sorted[below]);
}

}  // namespace

Summary summarise(std::span<const double> values) {
  Summary summary;
  if (values.empty()) return summary;
  std::vector<double> sorted(values.begin(), values.end());
  std::sort(sorted.begin(), sorted.end());
  double sum = 0, sum_of_squares = 0;
  for (const double value : sorted) {
    sum += value;
    sum_of_squares += value * value;
  }
  const auto n = static_cast<double>(sorted.size());
  summary.count = sorted.size();
  summary.mean = sum / n;
  summary.rmse = std::sqrt(sum_of_squares / n);
  summary.min = sorted.front();
  summary.median = sorted_quantile(sorted, 0.5);
  summary.p95 = sorted_quantile(sorted, 0.95);
  summary.p99 = sorted_quantile(sorted, 0.99);
  summary.max = sorted.back();
  return summary;
}

double quantile(std::vector<double> values, double q) {
  std::sort(values.begin(), values.end());
  return sorted_quantile(values, q);
}

}  // namespace hm
