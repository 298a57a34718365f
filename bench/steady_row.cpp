// Row steady: integration time at the start and at the end of a long run.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "contender.hpp"
#include "hm/core/stopwatch.hpp"
#include "measurement.hpp"

namespace hm::bench {
namespace {

constexpr std::size_t kViews = 60, kPasses = 4;

/// The same views `kPasses` times; the sum over views of the fastest time of each.
double time_views_ms(OurContender& contender, std::span<const RgbdFrame> views) {
  std::vector<double> fastest(views.size(), 1e9);
  contender.prepare(views);
  for (std::size_t pass = 0; pass < kPasses; ++pass)
    for (std::size_t i = 0; i < views.size(); ++i) {
      const Stopwatch watch;
      contender.integrate(i);
      fastest[i] = std::min(fastest[i], watch.milliseconds());
    }
  return std::accumulate(fastest.begin(), fastest.end(), 0.0);
}

}  // namespace

Result<BenchResult> bench_steady(const BenchOptions& options) {
  const FrameRange whole{static_cast<std::size_t>(options.frame_limit), 1, kViews};
  auto source = open_frames("sevenscenes_a", whole);
  if (!source) return forward_error(source);
  auto first = (*source)->next_chunk();
  if (!first) return forward_error(first);
  const std::vector<RgbdFrame> views(first->begin(), first->end());
  OurContender contender(common_params(0.02, 0.08), (*source)->camera(), 1);
  time_views_ms(contender, views);  // makes the volumes that these views see
  const double begin_ms = time_views_ms(contender, views);
  const std::size_t begin_volumes = contender.grid().volume_count();
  // The long run: everything that the recording holds, the views over and over between, until the first
  // and the last passes are a tenth of it each.
  for (int again = 0; again < 3; ++again) {
    while (true) {
      const auto chunk = (*source)->next_chunk();
      if (!chunk) return forward_error(chunk);
      if (chunk->empty()) break;
      contender.prepare(*chunk);
      for (std::size_t i = 0; i < chunk->size(); ++i) contender.integrate(i);
    }
    time_views_ms(contender, views);
    source = open_frames("sevenscenes_a", whole);
    if (!source) return forward_error(source);
  }
  const double end_ms = time_views_ms(contender, views);
  BenchResult result;
  result.rows.push_back({"steady", std::abs(end_ms / begin_ms - 1) * 100, {}});
  const auto per_frame = static_cast<double>(views.size());
  result.details = JsonValue::object({{"first_ms", begin_ms / per_frame},
                                      {"last_ms", end_ms / per_frame},
                                      {"change_percent", (end_ms / begin_ms - 1) * 100},
                                      {"first_volumes", begin_volumes},
                                      {"last_volumes", contender.grid().volume_count()},
                                      {"frames", contender.scans().size()}});
  return result;
}

}  // namespace hm::bench
