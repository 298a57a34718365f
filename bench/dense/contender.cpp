#include "dense/contender.hpp"

#include <limits>
#include <numeric>

#include "hm/core/stopwatch.hpp"

namespace hm::bench {

OurContender::OurContender(const TsdfParams& params, const PinholeCamera& camera, int threads)
    : loop_(threads), grid_(Integrator::make_grid(params)), integrator_(params, {}, camera, loop_) {}

void OurContender::integrate(std::size_t place) {
  ScanStats scan = integrator_.integrate(grid_, frames_[place]);
  scan.changed.clear();
  scans_.push_back(std::move(scan));
}

TsdfParams common_params(double voxel_size_m, double band_m) {
  TsdfParams params;
  params.voxel_size_m = voxel_size_m;
  params.dynamic_truncation = false;
  params.fixed_truncation_voxel = band_m / voxel_size_m;
  params.far_m = 4.0;
  return params;
}

double RaceResult::mean_ms() const {
  return std::accumulate(frame_ms.begin(), frame_ms.end(), 0.0) /
         static_cast<double>(std::max<std::size_t>(frame_ms.size(), 1));
}

namespace {

/// Lets one contender integrate a chunk; keeps the faster time of each frame.
void run_chunk(Contender& contender, std::span<const RgbdFrame> chunk, std::span<double> fastest_ms) {
  contender.prepare(chunk);
  for (std::size_t i = 0; i < chunk.size(); ++i) {
    const Stopwatch watch;
    contender.integrate(i);
    fastest_ms[i] = std::min(fastest_ms[i], watch.milliseconds());
  }
}

}  // namespace

Result<std::vector<RaceResult>> race(FrameSource& source, std::span<const Entry> entries, int rounds) {
  std::vector<RaceResult> results(entries.size());
  std::vector<std::vector<std::unique_ptr<Contender>>> contenders(entries.size());
  for (std::size_t e = 0; e < entries.size(); ++e)
    for (int r = 0; r < rounds; ++r) contenders[e].push_back(entries[e].make());
  while (true) {
    const auto chunk = source.next_chunk();
    if (!chunk) return forward_error(chunk);
    if (chunk->empty()) break;
    const std::size_t begin = results[0].frame_ms.size();
    for (auto& result : results)
      result.frame_ms.resize(begin + chunk->size(), std::numeric_limits<double>::infinity());
    for (int r = 0; r < rounds; ++r)
      for (std::size_t e = 0; e < entries.size(); ++e)
        run_chunk(*contenders[e][static_cast<std::size_t>(r)], *chunk,
                  std::span(results[e].frame_ms).subspan(begin));
  }
  for (std::size_t e = 0; e < entries.size(); ++e) results[e].contender = std::move(contenders[e][0]);
  return results;
}

}  // namespace hm::bench
