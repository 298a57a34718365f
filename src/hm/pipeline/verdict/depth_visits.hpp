#pragma once
#include "hm/core/run_context.hpp"
#include "hm/geometry/trajectory.hpp"
#include "hm/io/rgbd/recording.hpp"
#include "hm/pipeline/verdict/run_verdict.hpp"

namespace hm {

/// Adds what earlier visits of a place say of a trajectory: compares depth images of a recording with those
/// of earlier visits, as `T_world_camera` (at stamps of depth images) places them. Surfaces of one view must
/// not stand in the free space of another, and must not be tilted or shifted against it.
/// Takes at most sixty images, spread over the recording, each with the first and the last earlier one that
/// looks the same way from close by, two seconds before or more. Then judge_steps(). Images that cannot be
/// read are left out.
void judge_depth_visits(const Recording& recording, const Trajectory& T_world_camera, const RunContext& run,
                        RunVerdict& verdict);

}  // namespace hm
