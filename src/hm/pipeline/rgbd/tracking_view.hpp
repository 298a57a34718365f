#pragma once
#include <optional>

#include "hm/core/run_context.hpp"
#include "hm/geometry/trajectory.hpp"
#include "hm/pipeline/rgbd/visual_tracking.hpp"
#include "hm/slam/rgbd/live_rgbd_loop_closer.hpp"

namespace hm {

/// Shows a frame that was tracked, and the numbers of tracking so far, to RunContext::view (if there is one).
/// `frame`: null, where it could not be read.
void show_tracked(const RunContext& run, const VisualTracking& tracking, const PinholeCamera& camera,
                  const RgbdFrame* frame, const std::optional<SE3>& T_map_camera);

/// Shows the path of all frames and the keyframes, as loops have placed them.
void show_corrected(const RunContext& run, const Trajectory& T_map_camera,
                    const CorrectedKeyframes& keyframes);

}  // namespace hm
