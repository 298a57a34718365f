#include "hm/pipeline/checks/stream_report.hpp"

#include <algorithm>

#include "hm/core/statistics.hpp"

namespace hm {

StreamReport describe_stream(std::string name, const std::vector<Time>& stamps, std::size_t count) {
  StreamReport stream{.name = std::move(name), .count = count};
  if (stamps.size() < 2) return stream;
  std::vector<double> intervals;
  for (std::size_t i = 1; i < stamps.size(); ++i) intervals.push_back((stamps[i] - stamps[i - 1]).seconds());
  const double median = quantile(intervals, 0.5);
  stream.rate_hz = median > 0 ? 1.0 / median : 0.0;
  stream.duration_s = (stamps.back() - stamps.front()).seconds();
  stream.longest_gap_s = *std::ranges::max_element(intervals);
  stream.gaps = static_cast<std::size_t>(
      std::ranges::count_if(intervals, [&](double interval) { return interval > 2.5 * median; }));
  return stream;
}

void visit(const StreamReport& stream, SummaryTree& v) {
  v({"name", {}, "{:<10}"}, stream.name);
  v({"count"}, stream.count);
  v({"rate_hz", {}, "{:.1f} Hz"}, stream.rate_hz);
  v({"duration_s", {}, "{:.2f} s"}, stream.duration_s);
  v({"gaps"}, stream.gaps);
  v({"longest_gap_s", {}, "{:.0f} ms", 1e3}, stream.longest_gap_s);
}

std::string stream_line(const StreamReport& stream) {
  return *describe(stream).sentence(
      stream.rate_hz <= 0     ? "{name} {count}"
      : stream.has_own_stamps ? "{name} {count}, {rate_hz}, {duration_s}, longest interval {longest_gap_s}"
                              : "{name} {count}, no stamps of their own, {rate_hz} assumed");
}

}  // namespace hm
