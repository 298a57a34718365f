#include "hm/mapping/keyframes/keyframe_depths.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace hm {

SE3 motion_to_depth(const Trajectory& T_odom_camera, Time stamp, double color_delay_s) {
  constexpr double kNear_s = 0.1;  // beyond, the velocity may have changed
  const auto at = std::lower_bound(T_odom_camera.begin(), T_odom_camera.end(), stamp,
                                   [](const StampedPose& pose, Time t) { return pose.stamp < t; });
  if (color_delay_s == 0 || at == T_odom_camera.end()) return {};
  const auto is_near = [&](const StampedPose& pose) {
    return std::abs((pose.stamp - stamp).seconds()) < kNear_s;
  };
  const auto before = at != T_odom_camera.begin() && is_near(*(at - 1)) ? at - 1 : at;
  const auto after = at + 1 != T_odom_camera.end() && is_near(*(at + 1)) ? at + 1 : at;
  if (before == after || !is_near(*at)) return {};
  const double share = -color_delay_s / (after->stamp - before->stamp).seconds();
  return SE3::exp(share * (before->T_world_base.inverse() * after->T_world_base).log());
}

KeyframeDepths keyframe_depths(const FrameSource& frames, Trajectory T_odom_camera, double color_delay_s,
                               const DepthNoise& noise) {
  const auto read = [&frames, path = std::move(T_odom_camera),
                     color_delay_s](const Keyframe& keyframe) -> std::optional<KeyframeDepth> {
    auto frame = frames.read_depth(keyframe.frame_index);
    if (!frame) return std::nullopt;
    return KeyframeDepth{std::move(frame->depth), motion_to_depth(path, keyframe.stamp, color_delay_s)};
  };
  return {read, noise};
}

}  // namespace hm
