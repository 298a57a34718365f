#pragma once
#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

namespace hm {

/// Count, mean, root mean square and percentiles of a set of numbers; all zero when the set is empty.
struct Summary {
  std::size_t count = 0;
  double mean = 0, rmse = 0, min = 0, median = 0, p95 = 0, p99 = 0, max = 0;
};
Summary summarise(std::span<const double> values);

/// q-quantile (0..1) with linear interpolation between order statistics; 0 for an empty set.
double quantile(std::vector<double> values, double q);

/// Medians of the chi-squared distribution with two and three degrees of freedom.
inline constexpr double kMedianChi2Of2 = 1.386, kMedianChi2Of3 = 2.366;

/// Median of at least one value (the upper median for an even count). Reorders the values.
template <class T>
T middle_value(std::span<T> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Returns at most `most` of the items, evenly spaced from the first one, in their order.
template <class Item>
std::vector<Item> thinned(std::vector<Item> items, std::size_t most) {
  if (items.size() <= most) return items;
  for (std::size_t i = 0; i < most; ++i) items[i] = items[i * items.size() / most];
  items.erase(items.begin() + static_cast<std::ptrdiff_t>(most), items.end());
  return items;
}

}  // namespace hm
