#pragma once
#include <array>
#include <cstdint>
#include <string>

#include "hm/core/time.hpp"

namespace hm {

/// Distribution of a latency or an age in bins of half a millisecond, in bounded memory.
class LatencyHistogram {
 public:
  static constexpr std::size_t kBins = 1000;
  static constexpr Duration kBin{500'000};
  /// Adds a latency; negative ones count as zero.
  void add(Duration latency);
  [[nodiscard]] std::uint64_t count() const { return count_; }
  [[nodiscard]] double mean_s() const;
  [[nodiscard]] double max_s() const { return max_.seconds(); }
  /// Upper edge of the bin that holds the q-quantile (0..1), at most the maximum; 0 without a latency.
  [[nodiscard]] double quantile_s(double q) const;

 private:
  std::array<std::uint64_t, kBins + 1> bins_{};  // the last one: all above
  std::uint64_t count_ = 0;
  double sum_s_ = 0;
  Duration max_;
};

/// Messages of a stage of a flight.
struct StageCounts {
  std::string stage;
  std::uint64_t in = 0, out = 0;
  std::uint64_t dropped = 0;  ///< lost on a link, damaged, refused or without a result
};

/// Latencies of a stage of a flight.
struct StageLatency {
  std::string stage;
  LatencyHistogram latency;
};

}  // namespace hm
