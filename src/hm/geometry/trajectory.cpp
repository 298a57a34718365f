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

double path_length(const Trajectory& trajectory) {
  double length = 0;
  for (std::size_t i = 1; i < trajectory.size(); ++i)
    length +=
        (trajectory[i].T_world_base.translation() - trajectory[i - 1].T_world_base.translation()).norm();
  return length;
}

}  // namespace hm
