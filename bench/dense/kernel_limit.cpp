// What the integration kernel must touch per frame, and how long the machine needs to move that much.
#include <cstring>

#include "dense/contender.hpp"
#include "hm/core/stopwatch.hpp"
#include "measurement.hpp"

namespace hm::bench {
namespace {

/// Bytes read and written per second when a buffer of this size is read, changed and written over and over.
double update_rate_bytes_s(std::size_t bytes) {
  std::vector<std::uint32_t> words(bytes / 4, 1);
  const std::size_t passes = std::max<std::size_t>((std::size_t{1} << 29) / bytes, 4);
  double best_s = 1e9;
  for (int repetition = 0; repetition < 5; ++repetition) {
    const Stopwatch watch;
    for (std::size_t pass = 0; pass < passes; ++pass) {
      for (std::uint32_t& word : words) word += 3;
      asm volatile("" : : "r"(words.data()) : "memory");
    }
    best_s = std::min(best_s, watch.seconds());
  }
  return 2.0 * static_cast<double>(bytes * passes) / best_s;
}

struct Totals {
  double volumes = 0, updated = 0, kernel_ms = 0, all_ms = 0, frames = 0;
};

Totals add_up(const OurContender& contender) {
  Totals totals;
  for (const ScanStats& scan : contender.scans()) {
    totals.volumes += static_cast<double>(scan.volumes_touched);
    totals.updated += static_cast<double>(scan.voxels_updated);
    totals.kernel_ms += scan.integrate_ms;
    totals.all_ms += scan.total_ms;
    totals.frames += 1;
  }
  return totals;
}

}  // namespace

Result<BenchResult> bench_kernel_limit(const BenchOptions& options) {
  auto source = open_frames("sevenscenes_a", {static_cast<std::size_t>(options.frame_limit), 1, 40});
  if (!source) return forward_error(source);
  const PinholeCamera camera = (*source)->camera();
  const TsdfParams with_color = common_params(0.02, 0.08);
  TsdfParams depth_only = with_color;
  depth_only.color = false;
  const Entry entries[] = {{"depth", [=] { return std::make_unique<OurContender>(depth_only, camera, 1); }},
                           {"color", [=] { return std::make_unique<OurContender>(with_color, camera, 1); }}};
  const auto results = race(**source, entries, 1);
  if (!results) return forward_error(results);
  const double l2_bytes_s = update_rate_bytes_s(std::size_t{256} << 10);
  const double memory_bytes_s = update_rate_bytes_s(std::size_t{256} << 20);
  BenchResult result;
  result.details =
      JsonValue::object({{"l2_gb_s", l2_bytes_s * 1e-9}, {"memory_gb_s", memory_bytes_s * 1e-9}});
  for (std::size_t i = 0; i < 2; ++i) {
    const Totals totals = add_up(dynamic_cast<const OurContender&>(*(*results)[i].contender));
    const double voxels = totals.volumes * kVolumeVoxels;
    // Distance and weight are read and written; so is colour where it is kept, of which the band has a part.
    const double bytes = voxels * (i ? 16.0 : 8.0) / totals.frames;
    const double pixels = static_cast<double>(camera.width) * camera.height * (i ? 5.0 : 2.0);
    result.details[entries[i].name] =
        JsonValue::object({{"volumes_per_frame", totals.volumes / totals.frames},
                           {"voxels_per_frame", voxels / totals.frames},
                           {"voxels_updated_per_frame", totals.updated / totals.frames},
                           {"voxel_bytes_per_frame", bytes},
                           {"image_bytes_per_frame", pixels},
                           {"frame_ms", totals.all_ms / totals.frames},
                           {"kernel_ms", totals.kernel_ms / totals.frames},
                           {"kernel_ns_per_voxel", totals.kernel_ms * 1e6 / voxels},
                           {"frame_ns_per_voxel", totals.all_ms * 1e6 / voxels},
                           {"kernel_gb_s", bytes / (totals.kernel_ms / totals.frames) * 1e-6},
                           {"limit_l2_ms", (bytes + pixels) / l2_bytes_s * 1e3},
                           {"limit_memory_ms", (bytes + pixels) / memory_bytes_s * 1e3}});
  }
  return result;
}

}  // namespace hm::bench
