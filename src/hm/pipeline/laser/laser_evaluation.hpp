#pragma once
#include "hm/io/laser/laser_recording.hpp"
#include "hm/pipeline/laser/laser_run.hpp"

namespace hm {

/// Fills error and relation_error, and error_odom and relation_error_odom where the run was
/// corrected; what cannot be compared becomes a warning.
void evaluate_laser_run(const LaserRecording& recording, const LaserRunOptions& options,
                        LaserSummary& summary);

}  // namespace hm
