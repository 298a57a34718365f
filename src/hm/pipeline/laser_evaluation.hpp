#pragma once
#include <span>

#include "hm/io/laser_recording.hpp"
#include "hm/pipeline/laser_run.hpp"

namespace hm {

/// Heights against the truth's z at their stamps, a constant offset (median) taken away; nothing when there
/// are fewer than three that can be compared.
std::optional<HeightError> evaluate_height(const Trajectory& truth, std::span<const LaserScanRecord> records);

/// Relations whose stamps are written as the recording wrote them, as the recording's stamps were mended.
std::vector<PoseRelation> with_mended_stamps(std::vector<PoseRelation> relations,
                                             std::span<const MendedStamp> mended);

/// Fills error, height_error and relation_error; what cannot be compared becomes a warning.
void evaluate_laser_run(const LaserRecording& recording, const LaserRunOptions& options,
                        LaserSummary& summary);

}  // namespace hm
