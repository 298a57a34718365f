#pragma once
#include <optional>
#include <span>
#include <vector>

#include "hm/io/laser/laser_recording.hpp"
#include "hm/pipeline/laser/laser_run.hpp"

namespace hm {

/// A scan that is in the map, and how it went there.
struct MappedScan {
  std::size_t laser = 0;
  Time scan_stamp, stamp;  ///< of the scan; of its pose
  SE3 T_odom_base;
  std::vector<SweepKnot> sweep;
};
/// The scan of a step; nothing where it is not in the map.
std::optional<MappedScan> mapped_scan(const LaserStep& step);

/// Input of a map in the frame `map`: the scans of a recording, what a pipeline made of them, and
/// its present estimate of the frame.
struct RebuildInput {
  const LaserRecording& recording;
  std::vector<LaserRig> rigs;  ///< of the recording's lasers
  std::span<const MappedScan> scans;
  const LaserMapFrame& map_frame;
};

/// The multi-volume grid anew, as if the corrections that are known now had been known when each scan came:
/// every scan of the recording is inserted again, in its order, moved by the correction of its moment. Costs
/// as much as building the map did; besides the two maps it needs one scan's points.
MultiVolumeGrid rebuild_laser_map(const RebuildInput& input, const LaserParameters& params,
                                  const RunContext& run);

}  // namespace hm
