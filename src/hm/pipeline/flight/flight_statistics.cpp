#include "hm/pipeline/flight/flight_statistics.hpp"

#include <algorithm>
#include <cmath>

namespace hm {

void LatencyHistogram::add(Duration latency) {
  latency = std::max(latency, Duration{});
  ++bins_[std::min(static_cast<std::size_t>(latency.ns / kBin.ns), kBins)];
  ++count_;
  sum_s_ += latency.seconds();
  max_ = std::max(max_, latency);
}

double LatencyHistogram::mean_s() const { return count_ > 0 ? sum_s_ / static_cast<double>(count_) : 0; }

double LatencyHistogram::quantile_s(double q) const {
  const auto wanted = static_cast<std::uint64_t>(std::ceil(q * static_cast<double>(count_)));
  std::uint64_t below = 0;
  for (std::size_t bin = 0; bin < kBins; ++bin) {
    below += bins_[bin];
    if (below >= wanted && below > 0)
      return std::min(static_cast<double>(bin + 1) * kBin.seconds(), max_.seconds());
  }
  return max_.seconds();
}

}  // namespace hm
