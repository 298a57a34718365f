#include "hm/io/laser/laser_ranges.hpp"

#include <algorithm>
#include <cmath>

namespace hm::detail {
namespace {

/// SICK scanners in centimetre mode report 8183 to 8191 for "no echo", "dazzled" and similar states.
constexpr float kFirstSickCode_m = 81.825F, kLastSickCode_m = 81.915F;

}  // namespace

float RangeSorter::no_return(float marker) {
  ++no_returns_;
  ++markers_[marker];
  return LaserScan::kNoReturn;
}

float RangeSorter::sorted(float range, const LaserScan& scan) {
  const bool negative = range < 0 && std::isfinite(range);
  if (range == 0 || (negative && negative_ == Negative::kNoReturn)) return no_return(range);
  if (!(range >= static_cast<float>(scan.range_min_m)) || range < 0) {
    ++invalid_;
    return LaserScan::kInvalid;
  }
  const bool is_sick_code = range >= kFirstSickCode_m && range <= kLastSickCode_m;
  if (is_sick_code || !(static_cast<double>(range) < scan.range_max_m)) return no_return(range);
  return range;
}

void RangeSorter::sort(LaserScan& scan) {
  for (float& range : scan.ranges_m) range = sorted(range, scan);
}

void RangeSorter::report(LaserStream& stream) const {
  constexpr std::size_t kMostMarkers = 8;
  stream.no_returns = no_returns_;
  stream.invalid = invalid_;
  stream.sentinels_m.assign(markers_.begin(), markers_.end());
  std::ranges::stable_sort(stream.sentinels_m, std::ranges::greater{},
                           &std::pair<float, std::size_t>::second);
  if (stream.sentinels_m.size() > kMostMarkers) stream.sentinels_m.resize(kMostMarkers);
}

}  // namespace hm::detail
