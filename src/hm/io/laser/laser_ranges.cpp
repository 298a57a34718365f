#include "hm/io/laser/laser_ranges.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace hm::detail {
namespace {

/// SICK scanners in centimetre mode report 8183 to 8191 for "no echo", "dazzled" and similar states.
constexpr float kFirstSickCode_m = 81.825F, kLastSickCode_m = 81.915F;

}  // namespace

std::optional<ReadingProblem> problem_of(const LaserScan& scan) {
  constexpr double kFullTurn_rad = 2 * std::numbers::pi, kMostTurns = 1.1;
  using Reason = SkippedLines::Reason;
  const double span_rad = std::fabs(scan.angle_increment_rad) * static_cast<double>(scan.size());
  for (const double value : {scan.angle_min_rad, span_rad, scan.time_increment_s, scan.range_min_m})
    if (!std::isfinite(value)) return ReadingProblem{Reason::kNotFinite, {}};
  if (std::isnan(scan.range_max_m)) return ReadingProblem{Reason::kNotFinite, {}};
  const auto malformed = [](std::string why) { return ReadingProblem{Reason::kMalformed, std::move(why)}; };
  if (scan.ranges_m.empty()) return malformed("no ranges");
  if (scan.range_max_m <= scan.range_min_m)
    return malformed(fmt::format("range_max is {:.6g}{}", scan.range_max_m,
                                 scan.range_max_m == 0
                                     ? std::string()
                                     : fmt::format(", not over range_min, {:.6g}", scan.range_min_m)));
  if (scan.angle_increment_rad == 0) return malformed("angle_increment is 0");
  if (span_rad <= kMostTurns * kFullTurn_rad) return std::nullopt;
  if (std::fabs(scan.angle_min_rad) > kFullTurn_rad)
    return malformed(fmt::format("angle_min is {:.6g}: degrees?", scan.angle_min_rad));
  return malformed(fmt::format("the beams span {:.6g} rad, more than a turn: degrees?", span_rad));
}

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
