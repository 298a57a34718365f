#pragma once
#include "hm/io/laser/laser_recording.hpp"
#include "hm/pipeline/laser/run/laser_run.hpp"

namespace hm {

/// The maps of a run.
struct LaserMaps {
  const MultiVolumeGrid& map;                 ///< in the frame `map`
  const MultiVolumeGrid* map_odom = nullptr;  ///< in `odom`, where that is another: only for a figure
};

/// Measures a run against truth and relations where there are any, and writes everything that it leaves.
/// Completes the summary. An error is one of writing.
Result<void> write_laser_results(const LaserMaps& maps, const LaserRecording& recording,
                                 const LaserRunOptions& options, LaserSummary& summary);

}  // namespace hm
