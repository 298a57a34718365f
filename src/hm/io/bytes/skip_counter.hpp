#pragma once
#include <algorithm>
#include <filesystem>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "hm/core/time.hpp"
#include "hm/io/bytes/skipped_lines.hpp"

namespace hm::detail {

/// Counts skipped lines by reason.
class SkipCounter {
 public:
  explicit SkipCounter(const std::filesystem::path& path) : file_(path.filename().string()) {}
  /// Counter for the messages of a stream instead of the lines of a file.
  static SkipCounter of_messages(std::string stream) {
    SkipCounter counter;
    counter.file_ = std::move(stream);
    counter.unit_ = "message";
    return counter;
  }
  /// Counts a line, at most once per reason. Lines with the same reason and words of `why` are one entry;
  /// after a few words the others are counted without.
  void add(SkippedLines::Reason reason, std::size_t line, std::string why = {}) {
    constexpr std::size_t kMostEntries = 8;
    if (!seen_.emplace(reason, line).second) return;
    const auto is_of = [&](const SkippedLines& known) { return known.reason == reason && known.why == why; };
    if (skipped_.size() >= kMostEntries && std::ranges::none_of(skipped_, is_of)) why.clear();
    for (SkippedLines& known : skipped_) {
      if (!is_of(known)) continue;
      ++known.count;
      known.first_line = std::min(known.first_line, line);
      return;
    }
    skipped_.push_back({reason, file_, 1, line, unit_, {}, std::move(why)});
  }
  [[nodiscard]] std::vector<SkippedLines> take() { return std::move(skipped_); }

 private:
  SkipCounter() = default;
  std::string file_;
  std::string_view unit_ = "line";
  std::vector<SkippedLines> skipped_;
  std::set<std::pair<SkippedLines::Reason, std::size_t>> seen_;
};

/// Indices of a longest strictly increasing subsequence, i.e. of the stamps left after removing as few as
/// possible.
std::vector<std::size_t> longest_increasing(std::span<const Time> stamps);

/// Indices in which items are taken: as they are, or sorted by stamp where time runs back so often that the
/// order is none of time (as of a folder's listing) and not that of a clock that was set back.
std::vector<std::size_t> order_by_time(std::span<const Time> stamps);

/// Keeps the items with increasing stamps, in order_by_time(); the others are counted in `skips` with their
/// line number.
template <class Item, class StampOf>
std::vector<Item> keep_increasing(std::vector<Item> items, const std::vector<std::size_t>& line_numbers,
                                  const StampOf& stamp_of, SkipCounter& skips) {
  std::vector<Time> stamps;
  for (const Item& item : items) stamps.push_back(stamp_of(item));
  const std::vector<std::size_t> order = order_by_time(stamps);
  std::ranges::transform(order, stamps.begin(), [&](std::size_t i) { return stamp_of(items[i]); });
  const std::vector<std::size_t> kept = longest_increasing(stamps);
  std::vector<Item> result;
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (result.size() < kept.size() && kept[result.size()] == i)
      result.push_back(std::move(items[order[i]]));
    else
      skips.add(SkippedLines::Reason::kStampNotIncreasing, line_numbers[order[i]]);
  }
  return result;
}

}  // namespace hm::detail
