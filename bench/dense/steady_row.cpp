// Row steady: integration time at the start and at the end of a long run.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "dense/contender.hpp"
#include "hm/core/stopwatch.hpp"
#include "hm/tsdf/grid/volume_grid.hpp"
#include "measurement.hpp"

namespace hm::bench {
namespace {

constexpr std::size_t kViews = 60;
constexpr int kWarmUp = 2, kPasses = 8;

void integrate_all(OurContender& contender, std::span<const RgbdFrame> frames) {
  contender.prepare(frames);
  for (std::size_t i = 0; i < frames.size(); ++i) contender.integrate(i);
}

void keep_fastest(OurContender& contender, std::span<double> fastest_ms) {
  for (std::size_t i = 0; i < fastest_ms.size(); ++i) {
    const Stopwatch watch;
    contender.integrate(i);
    fastest_ms[i] = std::min(fastest_ms[i], watch.milliseconds());
  }
}

/// Integrates the whole recording `times` over, the views between.
Result<void> long_run(OurContender& contender, std::span<const RgbdFrame> views, const FrameRange& range,
                      int times) {
  for (int time = 0; time < times; ++time) {
    auto source = open_frames("sevenscenes_a", range);
    if (!source) return forward_error(source);
    while (true) {
      const auto chunk = (*source)->next_chunk();
      if (!chunk) return forward_error(chunk);
      if (chunk->empty()) break;
      integrate_all(contender, *chunk);
    }
    integrate_all(contender, views);
  }
  return {};
}

}  // namespace

/// The beginning of a run is lived through again beside its end: a fresh map that has seen the views twice,
/// and one that a long run has grown and aged, take the same views in turn. So what else the machine does
/// meets both alike.
Result<BenchResult> bench_steady(const BenchOptions& options) {
  const FrameRange range{static_cast<std::size_t>(options.frame_limit), 1, kViews};
  auto source = open_frames("sevenscenes_a", range);
  if (!source) return forward_error(source);
  const auto first = (*source)->next_chunk();
  if (!first) return forward_error(first);
  const std::vector<RgbdFrame> views(first->begin(), first->end());
  const TsdfParams params = common_params(0.02, 0.08);
  OurContender aged(params, (*source)->camera(), 1), fresh(params, (*source)->camera(), 1);
  if (const auto done = long_run(aged, views, range, 3); !done) return forward_error(done);
  for (int pass = 0; pass < kWarmUp; ++pass) integrate_all(fresh, views);
  std::vector<double> first_ms(views.size(), 1e9), last_ms(views.size(), 1e9);
  aged.prepare(views);
  for (int pass = 0; pass < kPasses; ++pass) {
    keep_fastest(fresh, first_ms);
    keep_fastest(aged, last_ms);
  }
  const double begin_ms = std::accumulate(first_ms.begin(), first_ms.end(), 0.0);
  const double end_ms = std::accumulate(last_ms.begin(), last_ms.end(), 0.0);
  BenchResult result;
  result.rows.push_back({"steady", std::abs(end_ms / begin_ms - 1) * 100, {}});
  const auto per_frame = static_cast<double>(views.size());
  result.details = JsonValue::object({{"first_ms", begin_ms / per_frame},
                                      {"last_ms", end_ms / per_frame},
                                      {"change_percent", (end_ms / begin_ms - 1) * 100},
                                      {"first_volumes", fresh.grid().volume_count()},
                                      {"last_volumes", aged.grid().volume_count()},
                                      {"frames", aged.scans().size()}});
  return result;
}

}  // namespace hm::bench
