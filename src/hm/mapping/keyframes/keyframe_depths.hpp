#pragma once
#include "hm/geometry/trajectory.hpp"
#include "hm/io/rgbd/frame_source.hpp"
#include "hm/slam/rgbd/keyframe_surfaces.hpp"

namespace hm {

/// Pose of the camera when the depth image of a frame was taken, relative to that of the frame: colour, and
/// with it the frame's pose, is `color_delay_s` later. From the mean velocity between the poses before and
/// after; identity where there are none within a tenth of a second.
SE3 motion_to_depth(const Trajectory& T_odom_camera, Time stamp, double color_delay_s);

/// Reads the depth images of keyframes from `frames`, which must outlive the result, by their frame_index.
KeyframeDepths keyframe_depths(const FrameSource& frames, Trajectory T_odom_camera, double color_delay_s,
                               const DepthNoise& noise);

}  // namespace hm
