#pragma once
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "hm/core/time.hpp"
#include "hm/report/summary_tree.hpp"

namespace hm {

/// Rate and holes of one stream of a recording.
struct StreamReport {
  std::string name;  ///< "depth", "color", "poses", "truth", a topic ...
  std::size_t count = 0;
  double rate_hz = 0;  ///< from the median interval; 0 when there are no stamps
  double duration_s = 0;
  std::size_t gaps = 0;        ///< intervals of more than 2.5 times the median
  double longest_gap_s = 0;    ///< the longest interval, gap or not
  bool has_own_stamps = true;  ///< else the rate is assumed
};

/// The report of a stream with these stamps, in order; `count` may be more than there are stamps for.
StreamReport describe_stream(std::string name, const std::vector<Time>& stamps, std::size_t count);
/// name, count, rate_hz, duration_s, gaps, longest_gap_s.
void visit(const StreamReport& stream, SummaryTree& v);
/// A line for a terminal, without its end.
std::string stream_line(const StreamReport& stream);

/// The stamps of things that have one.
template <class Item>
std::vector<Time> stamps_of(const std::vector<Item>& items) {
  std::vector<Time> stamps;
  stamps.reserve(items.size());
  for (const Item& item : items) stamps.push_back(item.stamp);
  return stamps;
}

}  // namespace hm
