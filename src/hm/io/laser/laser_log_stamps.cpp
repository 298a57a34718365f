#include <algorithm>
#include <array>

#include "hm/io/laser/laser_log.hpp"

namespace hm::detail {
namespace {

/// Candidates for a stamp: as written, and with 1 to 5 additional zeros after the decimal point.
struct Readings {
  static constexpr std::size_t kMost = 6;
  std::array<Time, kMost> times;
  std::size_t count = 0;
};

Readings readings_of(Time written) {
  constexpr std::int64_t kSecond_ns = 1'000'000'000, kMicrosecond_ns = 1000;
  Readings readings;
  readings.times[readings.count++] = written;
  if (written.ns < 0 || written.ns % kMicrosecond_ns != 0) return readings;
  std::int64_t micros = written.ns % kSecond_ns / kMicrosecond_ns;
  const std::int64_t whole_ns = written.ns - written.ns % kSecond_ns;
  // A missing leading zero shifts the digits, so a zero was appended at the end.
  while (micros != 0 && micros % 10 == 0 && readings.count < Readings::kMost) {
    micros /= 10;
    readings.times[readings.count++] = Time{whole_ns + micros * kMicrosecond_ns};
  }
  return readings;
}

std::size_t count_backwards(const std::vector<Time>& stamps) {
  std::size_t count = 0;
  for (std::size_t i = 1; i < stamps.size(); ++i) count += stamps[i] <= stamps[i - 1];
  return count;
}

/// Lowest cost up to a candidate of one stamp: a step backwards is expensive, a change is cheap.
struct Cost {
  std::size_t cost = 0;
  std::size_t from = 0;  ///< candidate of the previous stamp
};
using Costs = std::array<Cost, Readings::kMost>;

/// Candidates, one per stamp, with the lowest total cost (dynamic programming in file order).
std::vector<Time> cheapest(const std::vector<Readings>& readings) {
  const std::size_t backwards_cost = readings.size() + 1;
  std::vector<Costs> costs(readings.size());
  for (std::size_t i = 0; i < readings.size(); ++i)
    for (std::size_t k = 0; k < readings[i].count; ++k) {
      Cost best{k > 0 ? std::size_t{1} : 0, 0};
      for (std::size_t j = 0; i > 0 && j < readings[i - 1].count; ++j) {
        const bool backwards = readings[i].times[k] <= readings[i - 1].times[j];
        const std::size_t cost = costs[i - 1][j].cost + (backwards ? backwards_cost : 0) + (k > 0 ? 1 : 0);
        if (j == 0 || cost < best.cost) best = {cost, j};
      }
      costs[i][k] = best;
    }
  std::vector<Time> chosen(readings.size());
  std::size_t at = 0;
  for (std::size_t k = 1; k < readings.back().count; ++k)
    if (costs.back()[k].cost < costs.back()[at].cost) at = k;
  for (std::size_t i = readings.size(); i-- > 0; at = costs[i][at].from) chosen[i] = readings[i].times[at];
  return chosen;
}

}  // namespace

std::vector<CorrectedStamp> stamps_with_lost_zeros(const std::vector<Time>& stamps) {
  constexpr std::size_t kAtLeastExplained = 10;  // at most one of this many steps backwards may remain
  const std::size_t backwards = count_backwards(stamps);
  if (backwards == 0) return {};
  std::vector<Readings> readings;
  for (const Time stamp : stamps) readings.push_back(readings_of(stamp));
  const std::vector<Time> chosen = cheapest(readings);
  if (count_backwards(chosen) * kAtLeastExplained > backwards) return {};
  std::vector<CorrectedStamp> corrected;
  for (std::size_t i = 0; i < stamps.size(); ++i)
    if (chosen[i] != stamps[i]) corrected.push_back({stamps[i], chosen[i]});
  std::ranges::sort(corrected, {}, &CorrectedStamp::written);
  return corrected;
}

}  // namespace hm::detail
