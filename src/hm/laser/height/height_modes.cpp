#include "hm/laser/height/height_modes.hpp"

#include <algorithm>
#include <cmath>

namespace hm {
namespace {

using Distances = std::span<const double>;

/// Start of the mode search: mean of the window of this width with most readings; ties go to the narrowest.
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

/// Mean shift with Tukey's biweight: readings far from the mode, as at an edge, have little or no weight.
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

/// Intervals of found or rejected modes. Of two surfaces so close that they share readings only the stronger
/// one is kept; readings next to a rejected cluster belong to it.
class Occupied {
 public:
  explicit Occupied(double half_width_m) : half_width_m_(half_width_m) {}
  void add(double center, bool is_smear) {
    if (size_ < places_.size()) places_[size_++] = {center, (is_smear ? 2.0 : 1.6) * half_width_m_};
  }
  [[nodiscard]] bool covers(double center) const {
    return std::any_of(places_.begin(), places_.begin() + static_cast<std::ptrdiff_t>(size_),
                       [&](const Place& place) { return std::abs(place.center - center) < place.reach; });
  }

 private:
  struct Place {
    double center, reach;
  };
  double half_width_m_;
  std::array<Place, 64> places_{};
  std::size_t size_ = 0;
};

}  // namespace

HeightModes find_height_modes(std::span<double> distances_m, const HeightParams& params) {
  std::sort(distances_m.begin(), distances_m.end());
  HeightModes result;
  std::span<double> left = distances_m;
  const double half_width_m = params.mode_half_width_m();
  int explained = 0;
  Occupied occupied(half_width_m);
  const auto enough = static_cast<std::size_t>(params.min_readings);
  while (left.size() >= enough && result.size < HeightModes::kMax) {
    const double center = climb_to_mode(left, fullest_window(left, params.kBinSize_m), half_width_m);
    const auto begin = std::lower_bound(left.begin(), left.end(), center - half_width_m);
    const auto end = std::upper_bound(begin, left.end(), center + half_width_m);
    const HeightMode mode = measure({begin, end}, center);
    if (begin == end) break;
    if (mode.readings >= params.min_readings) {
      const bool smear =
          mode.spread_m > params.max_spread_m() || (result.rejected > 0 && occupied.covers(center));
      if (smear) {
        ++result.rejected;
      } else if (!occupied.covers(center)) {
        result.modes[static_cast<std::size_t>(result.size++)] = mode;
        explained += mode.readings;
      }
      occupied.add(center, smear);
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
