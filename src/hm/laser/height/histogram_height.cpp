#include "hm/laser/height/histogram_height.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace hm {

std::optional<HistogramHeight::Answer> HistogramHeight::update(Time time,
                                                               std::span<const double> distances_m) {
  if (distances_m.empty()) return std::nullopt;
  // Bins start at the lowest point, which is the largest distance.
  const double origin_m = *std::max_element(distances_m.begin(), distances_m.end());
  const auto bin_of = [&](double distance_m) {
    return static_cast<std::size_t>((origin_m - distance_m) / params_.kBinSize_m);
  };
  const double nearest_m = *std::min_element(distances_m.begin(), distances_m.end());
  std::vector<int> counts(bin_of(nearest_m) + 1, 0);
  for (const double distance_m : distances_m) ++counts[bin_of(distance_m)];
  const auto fullest =
      static_cast<std::size_t>(std::max_element(counts.begin(), counts.end()) - counts.begin());
  if (counts[fullest] < params_.min_values) return std::nullopt;
  double sum = 0, squares = 0;
  for (const double distance_m : distances_m)
    if (bin_of(distance_m) == fullest) sum += distance_m, squares += distance_m * distance_m;
  const double mean_m = sum / counts[fullest];
  Answer answer;
  answer.stdev_m = std::sqrt(std::max(squares / counts[fullest] - mean_m * mean_m, 0.0));
  if (answer.stdev_m > params_.max_stdev_m) return std::nullopt;

  answer.height_m = floor_m_ + mean_m;
  if (last_) {
    const double jump_m = last_->height_m - answer.height_m;
    if (std::abs(jump_m) > params_.max_height_jump_m) {
      floor_m_ += jump_m;
      answer.height_m += jump_m;
    }
    const double dt_s = (time - last_time_).seconds();
    if (dt_s > 0) answer.climb_m_s = (answer.height_m - last_->height_m) / dt_s;
  }
  answer.floor_level_m = floor_m_;
  last_ = answer;
  last_time_ = time;
  return answer;
}

}  // namespace hm
