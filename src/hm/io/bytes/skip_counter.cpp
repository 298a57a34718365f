#include "hm/io/bytes/skip_counter.hpp"

#include <numeric>

namespace hm::detail {

std::vector<std::size_t> order_by_time(std::span<const Time> stamps) {
  constexpr std::size_t kMostSetBacks = 3, kMostSetBacksOf = 50;  // at most three, or one in 50
  std::size_t set_back = 0;
  for (std::size_t i = 1; i < stamps.size(); ++i) set_back += stamps[i] < stamps[i - 1] ? 1 : 0;
  std::vector<std::size_t> order(stamps.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  if (set_back > std::max(kMostSetBacks, stamps.size() / kMostSetBacksOf))
    std::ranges::stable_sort(order, {}, [&](std::size_t i) { return stamps[i]; });
  return order;
}

std::vector<std::size_t> longest_increasing(std::span<const Time> stamps) {
  constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  std::vector<std::size_t> ends;  // ends[k]: the smallest last element of an increasing run of k + 1
  std::vector<std::size_t> before(stamps.size(), kNone);
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    const auto place =
        std::ranges::lower_bound(ends, stamps[i], {}, [&](std::size_t k) { return stamps[k]; });
    if (place != ends.begin()) before[i] = *(place - 1);
    if (place == ends.end())
      ends.push_back(i);
    else if (stamps[i] < stamps[*place])
      *place = i;
  }
  std::vector<std::size_t> kept(ends.size());
  std::size_t at = ends.empty() ? kNone : ends.back();
  for (std::size_t k = kept.size(); k-- > 0; at = before[at]) kept[k] = at;
  return kept;
}

}  // namespace hm::detail
