#pragma once
#include <cstddef>
#include <limits>
#include <vector>

#include "hm/core/time.hpp"

namespace hm {

/// One sweep of a planar range finder, in the `laser` frame (x forward, y left, beams in the plane z = 0).
/// Beam i points along angle_min_rad + i * angle_increment_rad and was measured at stamp + i *
/// time_increment_s.
///
/// A range is kept as it was measured, in metres, when it is a return; readers turn every marker for "no
/// return" (0, 81.83, 81.91, the range limit, inf ...) into `kNoReturn`, and everything that cannot be a
/// reading (NaN, negative) into `kInvalid`. Both fail every comparison `range <= x` that a return passes.
struct LaserScan {
  static constexpr float kNoReturn = std::numeric_limits<float>::infinity();  ///< nothing within reach
  static constexpr float kInvalid = std::numeric_limits<float>::quiet_NaN();

  Time stamp;  ///< of the first beam
  double angle_min_rad = 0, angle_increment_rad = 0;
  double time_increment_s = 0;  ///< between two beams; 0 where the recording does not say
  double range_min_m = 0, range_max_m = 0;
  std::vector<float> ranges_m;

  [[nodiscard]] std::size_t size() const { return ranges_m.size(); }
  [[nodiscard]] double angle_rad(std::size_t beam) const {
    return angle_min_rad + static_cast<double>(beam) * angle_increment_rad;
  }
  [[nodiscard]] Time stamp_of(std::size_t beam) const {
    return stamp + Duration::from_seconds(static_cast<double>(beam) * time_increment_s);
  }
  /// True for a reading within the sensor's limits.
  [[nodiscard]] bool is_return(std::size_t beam) const {
    const auto range = static_cast<double>(ranges_m[beam]);
    return range > range_min_m && range < range_max_m;  // false for NaN
  }
};

}  // namespace hm
