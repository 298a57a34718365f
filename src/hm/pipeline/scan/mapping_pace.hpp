#pragma once
#include <algorithm>
#include <chrono>
#include <cstddef>
#include <optional>

namespace hm {

/// Which frames of a live camera there is time to map. A frame is tracked but not mapped while the next one
/// waits, or would have to wait for the map: tracking suffers more from late and dropped frames than the map
/// does. Two in a row at most, so that the map grows on a slow machine too.
class MappingPace {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::size_t kMostUnmapped = 2;

  /// A frame that was received then is tracked next.
  void begin(Clock::time_point received) {
    if (received_) follow(period_ms_, milliseconds(received - *received_));
    received_ = received;
    pose_at_.reset();
    mapping_from_.reset();
  }
  /// Its pose is known now.
  void pose_known(Clock::time_point now) { pose_at_ = now; }
  /// It is to be mapped now, while so many others wait.
  bool is_late(std::size_t waiting, Clock::time_point now) {
    mapping_from_ = now;
    if (in_a_row_unmapped_ >= kMostUnmapped) return false;
    const bool next_would_wait =
        mapping_ms_ && period_ms_ && since_received_ms(now) + *mapping_ms_ > *period_ms_;
    return waiting > 0 || next_would_wait;
  }
  /// It is done. Returns the time from having it to its pose, or to knowing that it has none, ms.
  double end(bool has_pose, bool is_mapped, Clock::time_point now) {
    if (is_mapped && mapping_from_) follow(mapping_ms_, milliseconds(now - *mapping_from_));
    if (has_pose) in_a_row_unmapped_ = is_mapped ? 0 : in_a_row_unmapped_ + 1;
    return since_received_ms(pose_at_.value_or(now));
  }

 private:
  static double milliseconds(Clock::duration time) {
    return std::chrono::duration<double, std::milli>(time).count();
  }
  [[nodiscard]] double since_received_ms(Clock::time_point now) const {
    return milliseconds(now - *received_);
  }
  static void follow(std::optional<double>& mean, double value) {
    constexpr double kShare = 0.1;
    mean = mean ? *mean + kShare * (value - *mean) : value;
  }

  std::optional<Clock::time_point> received_, pose_at_, mapping_from_;  ///< of this frame
  std::optional<double> period_ms_, mapping_ms_;                        ///< means of the last frames
  std::size_t in_a_row_unmapped_ = 0;
};

}  // namespace hm
