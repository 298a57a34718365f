#include "hm/pipeline/laser/laser_rebuild.hpp"

#include <algorithm>

namespace hm {
namespace {

constexpr std::size_t kScansPerReport = 100;

const LaserScan* find_scan(const LaserRecording& recording, const MappedScan& mapped) {
  const auto& scans = recording.lasers[mapped.laser].scans;
  const auto found = std::lower_bound(scans.begin(), scans.end(), mapped.scan_stamp,
                                      [](const LaserScan& scan, Time stamp) { return scan.stamp < stamp; });
  return found != scans.end() && found->stamp == mapped.scan_stamp ? &*found : nullptr;
}

}  // namespace

std::optional<MappedScan> mapped_scan(const LaserStep& step) {
  if (!step.T_odom_base || step.sweep.empty()) return std::nullopt;
  return MappedScan{step.laser, step.scan_stamp, step.stamp, *step.T_odom_base, step.sweep};
}

MultiVolumeGrid rebuild_laser_map(const RebuildInput& input, const LaserParameters& params,
                                  const RunContext& run) {
  MultiVolumeGrid grid(params.mvog);
  SweepPoints points(params.run.clear_without_return_m);
  std::size_t done = 0;
  for (const MappedScan& mapped : input.scans) {
    if (++done % kScansPerReport == 0 && run.progress)
      run.progress({"map of the corrected path", done, input.scans.size(), {}});
    const LaserScan* scan = find_scan(input.recording, mapped);
    if (!scan) continue;
    const SE2 T_map_odom = input.map_frame.T_map_odom_at(mapped.stamp, SE2::from_se3(mapped.T_odom_base));
    points.compute_again(*scan, input.rigs[mapped.laser], mapped.sweep, T_map_odom.to_se3());
    grid.insert(points.beam_scan());
  }
  return grid;
}

}  // namespace hm
