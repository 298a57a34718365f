#include "hm/slam/rgbd/corrected_keyframes.hpp"

#include <algorithm>

namespace hm {
namespace {

/// Pose of a camera with this odometry pose, corrected like a keyframe before it.
SE3 carried_by(const CorrectedKeyframe& before, const SE3& T_odom_camera) {
  return before.T_map_camera * (before.T_odom_camera.inverse() * T_odom_camera);
}

/// The same by a keyframe after it.
SE3 carried_back_by(const CorrectedKeyframe& after, const SE3& T_odom_camera) {
  return after.T_map_camera * (after.T_odom_arrived.value_or(after.T_odom_camera).inverse() * T_odom_camera);
}

}  // namespace

std::size_t CorrectedKeyframes::keyframe_before(Time stamp) const {
  const auto after = std::upper_bound(keyframes_.begin(), keyframes_.end(), stamp,
                                      [](Time t, const CorrectedKeyframe& k) { return t < k.stamp; });
  return after == keyframes_.begin() ? 0 : static_cast<std::size_t>(after - keyframes_.begin()) - 1;
}

SE3 CorrectedKeyframes::T_map_odom() const {
  if (keyframes_.empty()) return {};
  return keyframes_.back().T_map_camera * keyframes_.back().T_odom_camera.inverse();
}

std::optional<SE3> CorrectedKeyframes::T_map_camera(Time stamp, const SE3& T_odom_camera) const {
  if (keyframes_.empty()) return std::nullopt;
  const std::size_t at = keyframe_before(stamp);
  const CorrectedKeyframe& before = keyframes_[at];
  const SE3 by_before = carried_by(before, T_odom_camera);
  if (stamp <= before.stamp || at + 1 == keyframes_.size() || keyframes_[at + 1].submap != before.submap)
    return by_before;
  const CorrectedKeyframe& after = keyframes_[at + 1];
  const double share = (stamp - before.stamp).seconds() / (after.stamp - before.stamp).seconds();
  return interpolate(by_before, carried_back_by(after, T_odom_camera), share);
}

int CorrectedKeyframes::map_at(Time stamp) const {
  return keyframes_.empty() ? 0 : keyframes_[keyframe_before(stamp)].map;
}

Trajectory CorrectedKeyframes::corrected(const Trajectory& T_odom_camera) const {
  Trajectory corrected;
  corrected.reserve(T_odom_camera.size());
  for (const StampedPose& pose : T_odom_camera)
    corrected.push_back(
        {pose.stamp, T_map_camera(pose.stamp, pose.T_world_base).value_or(pose.T_world_base)});
  return corrected;
}

}  // namespace hm
