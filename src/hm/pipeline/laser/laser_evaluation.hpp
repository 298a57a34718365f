#pragma once
#include <span>

#include "hm/io/laser/laser_recording.hpp"
#include "hm/pipeline/laser/laser_run.hpp"

namespace hm {

/// Heights against the truth's z at their stamps, a constant offset (median) taken away; nothing when there
/// are fewer than three that can be compared.
std::optional<HeightError> evaluate_height(const Trajectory& truth, std::span<const LaserScanRecord> records);

/// Fills error, height_error and relation_error, and error_odom and relation_error_odom where the run was
/// corrected; what cannot be compared becomes a warning.
void evaluate_laser_run(const LaserRecording& recording, const LaserRunOptions& options,
                        LaserSummary& summary);

}  // namespace hm
