#include "hm/geometry/trajectory.hpp"

#include <algorithm>

namespace hm {

std::optional<SE3> pose_at(const Trajectory& trajectory, Time stamp, Duration max_gap,
                           Duration max_extrapolation) {
  if (trajectory.empty()) return std::nullopt;
  const auto after = std::lower_bound(trajectory.begin(), trajectory.end(), stamp,
                                      [](const StampedPose& pose, Time t) { return pose.stamp < t; });
  if (after != trajectory.end() && after->stamp == stamp) return after->T_world_base;
  if (after == trajectory.begin() || after == trajectory.end()) {
    const StampedPose& end = after == trajectory.end() ? trajectory.back() : trajectory.front();
    const std::int64_t beyond = after == trajectory.end() ? (stamp - end.stamp).ns : (end.stamp - stamp).ns;
    if (beyond <= max_extrapolation.ns) return end.T_world_base;
    return std::nullopt;
  }
  const StampedPose& before = *(after - 1);
  const Duration gap = after->stamp - before.stamp;
  if (gap > max_gap) return std::nullopt;
  return interpolate(before.T_world_base, after->T_world_base,
                     static_cast<double>((stamp - before.stamp).ns) / static_cast<double>(gap.ns));
}

double path_length(std::span<const Vec3> positions_m) {
  constexpr double kLeastStep_m = 0.02;
  if (positions_m.empty()) return 0;
  double length_m = 0;
  Vec3 last_m = positions_m.front();
  for (const Vec3& position_m : positions_m) {
    const double step_m = (position_m - last_m).norm();
    if (step_m < kLeastStep_m) continue;
    length_m += step_m;
    last_m = position_m;
  }
  return length_m + (positions_m.back() - last_m).norm();
}

double path_length(const Trajectory& trajectory) {
  std::vector<Vec3> positions_m;
  positions_m.reserve(trajectory.size());
  for (const StampedPose& pose : trajectory) positions_m.push_back(pose.T_world_base.translation());
  return path_length(positions_m);
}

}  // namespace hm
