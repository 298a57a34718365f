#pragma once
#include <array>
#include <cstddef>
#include <functional>
#include <optional>

#include "hm/core/time.hpp"

namespace hm {

/// How long before its stamp a scan was measured, on the clock of the wheel odometry: recorders stamp scans
/// when they arrive, tenths of a second after the laser turned, and wheels by another clock or none.
///
/// Turns between scans as matching found them are compared with those that the wheels measured a little
/// earlier or later, for delays from -0.2 to 0.4 s; the delay with the least mean deviation counts where it
/// is clearly less than that of the present one. Constant rates of turn tell nothing and change nothing. Old
/// motions are forgotten within some hundred scans.
class WheelDelay {
 public:
  /// Heading of the wheel odometry at a time; nothing where it does not reach.
  using Heading = std::function<std::optional<double>(Time)>;

  /// Learns from a turn (rad) that matching found between two scans. Nothing is learned where the odometry
  /// does not reach `margin()` beyond both.
  void learn(Time from, Time to, double turn_rad, const Heading& heading);
  /// Wheel odometry is to be read at the stamp of a scan less this.
  [[nodiscard]] Duration delay() const { return delay_of(chosen_); }
  /// Wheel odometry is read up to so much after a scan's stamp.
  static Duration margin() { return Duration::from_seconds(static_cast<double>(kNoDelay) * kStep_s); }

 private:
  static constexpr double kStep_s = 0.02;
  static constexpr std::size_t kNoDelay = 10, kDelays = 31;
  static Duration delay_of(std::size_t i);
  void choose();

  std::array<double, kDelays> deviation_rad_{};  // sums, decreasing with age
  double scans_ = 0;                             // of these sums
  std::size_t chosen_ = kNoDelay;
};

}  // namespace hm
