#pragma once
#include "hm/io/laser_recording.hpp"
#include "hm/pipeline/laser_run.hpp"

namespace hm {

/// Measures a run against truth and relations where there are any, and writes everything that it leaves.
/// Completes the summary. An error is one of writing.
Result<void> write_laser_results(const MultiVolumeGrid& map, const LaserRecording& recording,
                                 const LaserRunOptions& options, LaserSummary& summary);

}  // namespace hm
