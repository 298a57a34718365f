// Rows about the speed of integration: ours against Open3D, scalar, one thread, without carving.
#include "dense/peer.hpp"
#include "hm/core/statistics.hpp"
#include "measurement.hpp"

namespace hm::bench {
namespace {

constexpr double kVoxel_m = 0.02, kBand_m = 0.08;

FrameRange range_of(const BenchOptions& options) {
  return {static_cast<std::size_t>(options.frame_limit), 1, 40};
}

Entry ours(const TsdfParams& params, const PinholeCamera& camera, int threads) {
  return {"ours", [=] { return std::make_unique<OurContender>(params, camera, threads); }};
}
Entry theirs(const PeerOptions& options, const PinholeCamera& camera) {
  return {"peer", [=] { return make_peer(options, camera); }};
}

/// Median of the per-frame ratios b / a.
double median_ratio(const RaceResult& a, const RaceResult& b) {
  std::vector<double> ratios;
  for (std::size_t i = 0; i < a.frame_ms.size(); ++i) ratios.push_back(b.frame_ms[i] / a.frame_ms[i]);
  return quantile(ratios, 0.5);
}

Measurement measured(const std::string& name, const RaceResult& us, const RaceResult* peer) {
  Measurement row{name, us.mean_ms(), {}};
  if (peer) row.peer = peer->mean_ms();
  return row;
}

/// Depth only, then with colour, each against the peer: rows `NAME_depth` and `NAME`.
Result<BenchResult> against_peer(const BenchOptions& options, PeerGrid grid, const std::string& name) {
  auto source = open_frames("sevenscenes_a", range_of(options));
  if (!source) return forward_error(source);
  const PinholeCamera camera = (*source)->camera();
  std::vector<Entry> entries;
  for (const bool color : {false, true}) {
    TsdfParams params = common_params(kVoxel_m, kBand_m);
    params.color = color;
    entries.push_back(ours(params, camera, options.threads));
    if (has_peer()) entries.push_back(theirs({grid, kVoxel_m, kBand_m, params.far_m, color}, camera));
  }
  const auto results = race(**source, entries, options.rounds);
  if (!results) return forward_error(results);
  const std::size_t step = has_peer() ? 2 : 1;
  const std::string ending =
      options.threads > 1 ? fmt::format("_{}_threads", options.threads) : std::string();
  BenchResult result;
  for (std::size_t i = 0; i < 2; ++i) {
    const RaceResult& us = (*results)[i * step];
    const RaceResult* peer = has_peer() ? &(*results)[i * step + 1] : nullptr;
    const std::string row = fmt::format("{}{}{}", name, i ? "" : "_depth", ending);
    result.rows.push_back(measured(row, us, peer));
    if (peer) result.details[fmt::format("{}_median_of_ratios", row)] = median_ratio(us, *peer);
    result.details["frames"] = us.frame_ms.size();
  }
  return result;
}

/// Ours with two settings, in turn: `first` is what is judged, `second` what it is held against.
Result<std::vector<RaceResult>> race_two(const BenchOptions& options, const TsdfParams& first,
                                         const TsdfParams& second, std::pair<int, int> threads) {
  auto source = open_frames("sevenscenes_a", range_of(options));
  if (!source) return forward_error(source);
  const PinholeCamera camera = (*source)->camera();
  const Entry entries[] = {ours(first, camera, threads.first), ours(second, camera, threads.second)};
  return race(**source, entries, options.rounds);
}

}  // namespace

Result<BenchResult> bench_scalable(const BenchOptions& options) {
  return against_peer(options, PeerGrid::kScalable, "open3d_scalable");
}

Result<BenchResult> bench_voxelblock(const BenchOptions& options) {
  return against_peer(options, PeerGrid::kVoxelBlock, "open3d_voxelblock");
}

Result<BenchResult> bench_simd(const BenchOptions& options) {
  const TsdfParams simd = common_params(kVoxel_m, kBand_m);
  TsdfParams scalar = simd;
  scalar.kernel = KernelChoice::kScalar;
  const auto results = race_two(options, simd, scalar, {1, 1});
  if (!results) return forward_error(results);
  return BenchResult{{measured("simd", (*results)[0], &(*results)[1])}, JsonValue::object()};
}

Result<BenchResult> bench_threads(const BenchOptions& options) {
  const TsdfParams params = common_params(0.01, kBand_m);
  const auto results = race_two(options, params, params, {2, 1});
  if (!results) return forward_error(results);
  return BenchResult{{measured("threads", (*results)[0], &(*results)[1])}, JsonValue::object()};
}

Result<BenchResult> bench_carving(const BenchOptions& options) {
  const TsdfParams on = common_params(kVoxel_m, kBand_m);
  TsdfParams off = on;
  off.carving = false;
  const auto results = race_two(options, on, off, {1, 1});
  if (!results) return forward_error(results);
  const double on_ms = (*results)[0].mean_ms(), off_ms = (*results)[1].mean_ms();
  return BenchResult{{{"carving", on_ms / off_ms, {}}},
                     JsonValue::object({{"on_ms", on_ms}, {"off_ms", off_ms}})};
}

Result<BenchResult> bench_tango(const BenchOptions& options) {
  SimulationParams scene;
  scene.sensor = SensorPreset::kTangoTablet;
  const Simulation simulation(scene);
  TsdfParams params;
  params.voxel_size_m = 0.03;
  FrameRange range = range_of(options);
  if (range.limit == 0) range.limit = 400;
  const auto source = simulated_frames(simulation, range);
  const Entry entries[] = {ours(params, simulation.camera(), 1)};
  const auto results = race(*source, entries, options.rounds);
  if (!results) return forward_error(results);
  const Summary ms = summarise((*results)[0].frame_ms);
  return BenchResult{{{"tango", ms.mean, {}}},
                     JsonValue::object({{"median_ms", ms.median}, {"p99_ms", ms.p99}, {"frames", ms.count}})};
}

}  // namespace hm::bench
