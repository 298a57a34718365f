#include "hm/laser/height_modes.hpp"

#include <algorithm>
#include <cmath>

namespace hm {
namespace {

using Distances = std::span<const double>;

/// Where to start climbing: the mean of the fullest window of this width, the narrowest of equals.
double fullest_window(Distances sorted, double width_m) {
  std::size_t best_begin = 0, best_end = 0;
  for (std::size_t begin = 0, end = 0; begin < sorted.size(); ++begin) {
    while (end < sorted.size() && sorted[end] - sorted[begin] <= width_m) ++end;
    const std::size_t count = end - begin, best = best_end - best_begin;
    const bool narrower =
        count == best && sorted[end - 1] - sorted[begin] < sorted[best_end - 1] - sorted[best_begin];
    if (count > best || narrower) best_begin = begin, best_end = end;
  }
  double sum = 0;
  for (std::size_t i = best_begin; i < best_end; ++i) sum += sorted[i] - sorted[best_begin];
  return sorted[best_begin] + sum / static_cast<double>(best_end - best_begin);
}

/// Mean shift with Tukey's biweight: readings far from the mode, as at an edge, count little or nothing.
double climb_to_mode(Distances sorted, double start, double half_width_m) {
  double center = start;
  for (int round = 0; round < 20; ++round) {
    double weights = 0, sum = 0;
    for (const double distance : sorted) {
      const double u = (distance - center) / half_width_m;
      if (std::abs(u) >= 1) continue;
      const double weight = (1 - u * u) * (1 - u * u);
      weights += weight;
      sum += weight * (distance - center);
    }
    if (weights <= 0) break;
    center += sum / weights;
    if (std::abs(sum) < 1e-7 * weights) break;
  }
  return center;
}

HeightMode measure(Distances members, double center) {
  double squares = 0;
  for (const double distance : members) squares += (distance - center) * (distance - center);
  const auto count = static_cast<double>(members.size());
  return {center, std::sqrt(squares / std::max(count - 1, 1.0)), static_cast<int>(members.size())};
}

/// Two surfaces so near to each other that they share readings cannot be told apart: the stronger stays.
bool overlaps_stronger(const HeightModes& found, double center, double half_width_m) {
  return std::any_of(found.modes.begin(), found.modes.begin() + found.size, [&](const HeightMode& mode) {
    return std::abs(mode.distance_m - center) < 1.6 * half_width_m;
  });
}

}  // namespace

HeightModes find_height_modes(std::span<double> distances_m, const HeightParams& params) {
  std::sort(distances_m.begin(), distances_m.end());
  HeightModes result;
  std::span<double> left = distances_m;
  const double half_width_m = params.mode_half_width_m();
  int explained = 0;
  const auto enough = static_cast<std::size_t>(params.min_readings);
  while (left.size() >= enough && result.size < HeightModes::kMax) {
    const double center = climb_to_mode(left, fullest_window(left, params.bin_size_m), half_width_m);
    const auto begin = std::lower_bound(left.begin(), left.end(), center - half_width_m);
    const auto end = std::upper_bound(begin, left.end(), center + half_width_m);
    const HeightMode mode = measure({begin, end}, center);
    if (begin == end) break;
    if (mode.readings >= params.min_readings) {
      if (mode.spread_m > params.max_spread_m())
        ++result.rejected;
      else if (!overlaps_stronger(result, center, half_width_m))
        result.modes[static_cast<std::size_t>(result.size++)] = mode, explained += mode.readings;
    }
    const auto tail = std::move(end, left.end(), begin);
    left = left.first(static_cast<std::size_t>(tail - left.begin()));
  }
  std::stable_sort(result.modes.begin(), result.modes.begin() + result.size,
                   [](const HeightMode& a, const HeightMode& b) { return a.readings > b.readings; });
  if (!distances_m.empty()) result.explained_ratio = explained / static_cast<double>(distances_m.size());
  return result;
}

}  // namespace hm
