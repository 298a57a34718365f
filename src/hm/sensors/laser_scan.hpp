#pragma once
#include <cstddef>
#include <limits>
#include <vector>

#include "hm/core/time.hpp"

namespace hm {

/// One scan of a planar laser range finder, in the `laser` frame (x forward, y left, beams in the plane z =
/// 0). Beam i points along angle_min_rad + i * angle_increment_rad and was measured at stamp + i *
/// time_increment_s.
///
/// Returns are ranges in metres as measured. Readers convert every marker of "no return" (0, 81.83, 81.91,
/// the range limit, inf ...) to `kNoReturn`, and invalid values (NaN, negative) to `kInvalid`. The comparison
/// `range <= x` is false for both.
struct LaserScan {
  static constexpr float kNoReturn = std::numeric_limits<float>::infinity();  ///< nothing within reach
  static constexpr float kInvalid = std::numeric_limits<float>::quiet_NaN();

  Time stamp;  ///< of the first beam
  double angle_min_rad = 0, angle_increment_rad = 0;
  double time_increment_s = 0;  ///< between two beams; 0 if not recorded
  double range_min_m = 0, range_max_m = 0;
  std::vector<float> ranges_m;

  [[nodiscard]] std::size_t size() const { return ranges_m.size(); }
  [[nodiscard]] double angle_rad(std::size_t beam) const {
    return angle_min_rad + static_cast<double>(beam) * angle_increment_rad;
  }
  [[nodiscard]] Time stamp_of(std::size_t beam) const {
    return stamp + Duration::from_seconds(static_cast<double>(beam) * time_increment_s);
  }
  /// True when the range is within the sensor's limits.
  [[nodiscard]] bool is_return(std::size_t beam) const {
    const auto range = static_cast<double>(ranges_m[beam]);
    return range > range_min_m && range < range_max_m;  // false for NaN
  }
};

}  // namespace hm
