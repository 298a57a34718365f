#include "hm/pipeline/rgbd/slam_state.hpp"

#include <algorithm>
#include <utility>

#include "hm/pipeline/rgbd/resume/earlier_map.hpp"

namespace hm {

Trajectory moved(const Trajectory& path, const SE3& T_moved_map) {
  Trajectory out;
  for (const StampedPose& pose : path) out.push_back({pose.stamp, T_moved_map * pose.T_world_base});
  return out;
}

void turn(SlamState& state, const Mat3& R_turned_map) {
  const SE3 T_turned_map(R_turned_map, Vec3::Zero());
  state.track.trajectory = moved(state.track.trajectory, T_turned_map);
  state.corrected = moved(state.corrected, T_turned_map);
  std::vector<CorrectedKeyframe> keyframes = state.keyframes->keyframes();
  for (CorrectedKeyframe& keyframe : keyframes) {
    keyframe.T_odom_camera = T_turned_map * keyframe.T_odom_camera;
    keyframe.T_map_camera = T_turned_map * keyframe.T_map_camera;
  }
  state.keyframes = std::make_shared<const CorrectedKeyframes>(std::move(keyframes));
  for (SE3& T_map_node : state.graph.T_map_node) T_map_node = T_turned_map * T_map_node;
}

namespace {

/// Calls `visit` for each pose in the map, with odometry's pose of the same frame before it.
template <class Visit>
void for_each_placed(const SlamState& state, const Visit& visit) {
  auto placed = state.corrected.begin();
  for (const StampedPose& pose : state.track.trajectory) {
    if (placed == state.corrected.end()) return;
    if (placed->stamp == pose.stamp) visit(pose.T_world_base, (placed++)->T_world_base);
  }
}

}  // namespace

void begin_odometry_in_map(SlamState& state) {
  std::optional<SE3> T_map_odom;
  for_each_placed(state, [&](const SE3& T_odom_camera, const SE3& T_map_camera) {
    if (!T_map_odom) T_map_odom = T_map_camera * T_odom_camera.inverse();
  });
  if (T_map_odom) state.track.trajectory = moved(state.track.trajectory, *T_map_odom);
}

double largest_shift_m(const SlamState& state) {
  double largest_m = 0;
  for_each_placed(state, [&](const SE3& T_odom_camera, const SE3& T_map_camera) {
    largest_m = std::max(largest_m, (T_map_camera.translation() - T_odom_camera.translation()).norm());
  });
  return largest_m;
}

ContinuedMap continued_map(const SlamState& state, const EarlierMap& earlier, int inliers_needed) {
  ContinuedMap continued;
  const std::size_t earlier_keyframes = earlier.keyframes().size();
  const Time start = earlier.first_stamp_of_new;
  continued.folder = earlier.folder;
  continued.earlier_keyframes = earlier_keyframes;
  continued.inliers_needed = inliers_needed;
  continued.best = state.loops.best_of_other_map;
  if (continued.best.inliers > 0) continued.best_at_s = (continued.best.stamp - start).seconds();
  const auto& keyframes = state.keyframes->keyframes();
  for (const PoseEdge3D& edge : state.graph.edges) {
    const auto [older, newer] = std::minmax(edge.from, edge.to);
    if (older >= earlier_keyframes || newer < earlier_keyframes || keyframes[newer].map != 0) continue;
    if (continued.loops++ == 0) continued.recognised_at_s = (keyframes[newer].stamp - start).seconds();
  }
  return continued;
}

}  // namespace hm
