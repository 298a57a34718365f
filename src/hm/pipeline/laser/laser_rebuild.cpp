#include "hm/pipeline/laser/laser_rebuild.hpp"

#include <algorithm>

namespace hm {
namespace {

constexpr std::size_t kScansPerReport = 100;

const LaserScan* find_scan(const LaserRecording& recording, const LaserStep& step) {
  const auto& scans = recording.lasers[step.laser].scans;
  const auto found = std::lower_bound(scans.begin(), scans.end(), step.scan_stamp,
                                      [](const LaserScan& scan, Time stamp) { return scan.stamp < stamp; });
  return found != scans.end() && found->stamp == step.scan_stamp ? &*found : nullptr;
}

}  // namespace

MultiVolumeGrid rebuild_laser_map(const RebuildInput& input, const LaserParameters& params,
                                  const RunContext& run) {
  MultiVolumeGrid grid(params.mvog);
  SweepPoints points(params.run.clear_without_return_m);
  std::size_t done = 0;
  for (const LaserScanRecord& record : input.records) {
    if (++done % kScansPerReport == 0 && run.progress)
      run.progress({"map of the corrected path", done, input.records.size(), {}});
    const LaserStep& step = record.step;
    const LaserScan* scan = step.T_odom_base ? find_scan(input.recording, step) : nullptr;
    if (!scan || step.sweep.empty()) continue;
    const SE2 T_map_odom = input.map_frame.T_map_odom_at(step.stamp, SE2::from_se3(*step.T_odom_base));
    points.compute_again(*scan, input.rigs[step.laser], step.sweep, T_map_odom.to_se3());
    grid.insert(points.beam_scan());
  }
  return grid;
}

}  // namespace hm
