#include "hm/laser/odometry/attitude_history.hpp"

#include <algorithm>

namespace hm {

bool AttitudeHistory::add(Time stamp, const Mat3& R_world_base) {
  if (!R_world_base.allFinite() || (!entries_.empty() && stamp <= entries_.back().stamp)) return false;
  entries_.push_back({stamp, Eigen::Quaterniond(R_world_base).normalized()});
  // Dropped in blocks, for constant amortised time.
  const auto is_kept = [&](const Entry& entry) { return stamp - entry.stamp <= keep_; };
  const auto first = std::find_if(entries_.begin(), entries_.end(), is_kept);
  if (first - entries_.begin() > static_cast<std::ptrdiff_t>(entries_.size() / 2))
    entries_.erase(entries_.begin(), first);
  return true;
}

std::optional<Mat3> AttitudeHistory::at(Time stamp) const {
  const auto after = std::lower_bound(entries_.begin(), entries_.end(), stamp,
                                      [](const Entry& entry, Time t) { return entry.stamp < t; });
  if (after != entries_.end() && after->stamp == stamp) return after->q_world_base.toRotationMatrix();
  const bool has_before = after != entries_.begin(), has_after = after != entries_.end();
  const bool near_before = has_before && stamp - std::prev(after)->stamp <= max_gap_;
  const bool near_after = has_after && after->stamp - stamp <= max_gap_;
  if (!near_before && !near_after) return std::nullopt;
  if (!has_after) return std::prev(after)->q_world_base.toRotationMatrix();
  if (!has_before) return after->q_world_base.toRotationMatrix();
  const Entry& before = *std::prev(after);
  const double ratio = (stamp - before.stamp).seconds() / (after->stamp - before.stamp).seconds();
  return before.q_world_base.slerp(ratio, after->q_world_base).toRotationMatrix();
}

}  // namespace hm
