#pragma once
#include <cstddef>
#include <utility>
#include <vector>

#include "hm/core/statistics.hpp"

namespace hm {

/// Items that come one by one, for runs without a known end: all of the first `most`, from then on an even
/// thinning of all that came (every 2nd, 4th, 8th ...), so that memory stays bounded.
template <class Item>
class EvenlyThinned {
 public:
  /// `most` is even.
  explicit EvenlyThinned(std::size_t most = std::size_t{1} << 15u) : most_(most) {}

  void push_back(Item item) {
    if (count_++ % stride_ != 0) return;
    if (items_.size() == most_) {
      for (std::size_t i = 0; 2 * i < most_; ++i) items_[i] = std::move(items_[2 * i]);
      items_.erase(items_.begin() + static_cast<std::ptrdiff_t>(most_ / 2), items_.end());
      stride_ *= 2;
    }
    items_.push_back(std::move(item));
  }
  /// Number of all items added, including those not kept.
  [[nodiscard]] std::size_t count() const { return count_; }
  [[nodiscard]] const std::vector<Item>& items() const { return items_; }
  std::vector<Item> take() { return std::move(items_); }

 private:
  std::size_t most_, count_ = 0, stride_ = 1;
  std::vector<Item> items_;
};

/// Summary of numbers that come one by one, in bounded memory. Up to 32,768 of them it is that of
/// summarise(), to the bit. Of more, count, mean, rmse, min and max are exact, and percentiles are those of
/// an even thinning of at least 16,384: a p99 lies between the true p98.7 and p99.3, a median between p48.8
/// and p51.2 (three standard deviations), unless the numbers repeat with the period of the thinning.
class RunningSummary {
 public:
  void add(double value);
  [[nodiscard]] Summary summary() const;

 private:
  EvenlyThinned<double> values_;
  double sum_ = 0, squares_ = 0, min_ = 0, max_ = 0;
};

}  // namespace hm
