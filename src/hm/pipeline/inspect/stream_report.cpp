#include "hm/pipeline/inspect/stream_report.hpp"

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

JsonValue to_json(const StreamReport& s) {
  return JsonValue::object({{"name", s.name},
                            {"count", static_cast<std::int64_t>(s.count)},
                            {"rate_hz", s.rate_hz},
                            {"duration_s", s.duration_s},
                            {"gaps", static_cast<std::int64_t>(s.gaps)},
                            {"longest_gap_s", s.longest_gap_s}});
}

}  // namespace hm
