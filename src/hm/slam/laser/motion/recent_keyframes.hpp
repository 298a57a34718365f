#pragma once
#include <cmath>
#include <cstddef>
#include <deque>
#include <utility>

#include "hm/geometry/se2.hpp"

namespace hm {

/// Last keyframes of scan odometry, what is kept of each as a Content: a scan becomes one when it was taken
/// far enough from the last one.
template <class Content>
class RecentKeyframes {
 public:
  static constexpr std::size_t kMost = 12;
  /// A keyframe when the last one is further away,
  static constexpr double kDistance_m = 0.3;
  /// or when turned further from it: 20 degrees.
  static constexpr double kAngle_rad = 0.35;

  struct Keyframe {
    SE2 T_odom_base;
    Content content;
  };

  /// Whether a scan from there is to be added.
  [[nodiscard]] bool is_due(const SE2& T_odom_base) const {
    if (keyframes_.empty()) return true;
    const SE2 motion = keyframes_.back().T_odom_base.inverse() * T_odom_base;
    return !(motion.translation().norm() < kDistance_m && std::abs(motion.angle()) < kAngle_rad);
  }
  /// Adds the newest one; of more than `kMost` the oldest is dropped.
  void add(const SE2& T_odom_base, Content content) {
    if (keyframes_.size() >= kMost) keyframes_.pop_front();
    keyframes_.push_back({T_odom_base, std::move(content)});
  }
  void clear() { keyframes_.clear(); }
  /// The oldest first.
  [[nodiscard]] const std::deque<Keyframe>& all() const { return keyframes_; }

 private:
  std::deque<Keyframe> keyframes_;
};

}  // namespace hm
