#pragma once
#include <optional>
#include <string>

#include "hm/odometry/interface/visual_odometry.hpp"

namespace hm {

/// Whether a method can use a frame without a colour image.
enum class ColorNeed { kAlways, kIfPresent };

/// Reason why a frame cannot be used (no colour, size different from the camera's, not later than the last
/// frame); empty when it can.
std::string reason_to_skip(const RgbdFrame& frame, const PinholeCamera& camera,
                           const std::optional<Time>& last_stamp, ColorNeed need = ColorNeed::kAlways);

/// Why a model cannot begin with a frame of these features, with depth and without.
std::string too_few_features(const TrackingNumbers& numbers, int needed);

/// Why a frame has no pose: the refusal of the last attempt, the most matches with a keyframe, and why depth
/// alone gives none (empty: it was not asked).
std::string why_lost(const std::string& refusal, std::size_t features, int keyframe_matches,
                     const TrackingNumbers& numbers, const std::string& depth_refusal);

/// Reads a frame of the run's history again, with or without colour. Errors: it cannot be read; it has become
/// unusable (kInvalidValue).
Result<RgbdFrame> read_again(std::size_t frame_index, const PinholeCamera& camera,
                             const OdometryHistory& history);

}  // namespace hm
