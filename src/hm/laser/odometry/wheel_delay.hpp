#pragma once
#include <array>
#include <cstddef>
#include <functional>
#include <optional>

#include "hm/core/time.hpp"

namespace hm {

/// How long before its stamp a scan was measured, on the clock of the wheel odometry: recorders stamp scans
/// when they arrive, a tenth of a second or two after the laser turned.
///
/// Turns between scans as matching found them are correlated with those that the wheels measured earlier by 0
/// to 0.4 s. The delay with the largest covariance counts where that is clearly larger than without delay.
/// (Not the one with the least deviation: between its readings odometry is interpolated, which smooths its
/// noise.) Constant rates of turn tell nothing. Old motions are forgotten within some hundred scans.
class WheelDelay {
 public:
  /// Heading of the wheel odometry at a time, rad; nothing where it does not reach.
  using Heading = std::function<std::optional<double>(Time)>;

  /// Learns from a turn (rad) that matching found between two scans. Nothing is learned where the odometry
  /// does not reach both, and 0.4 s before them.
  void learn(Time from, Time to, double turn_rad, const Heading& heading);
  /// Wheel odometry is to be read at the stamp of a scan less this.
  [[nodiscard]] Duration delay() const { return delay_of(chosen_); }

 private:
  static constexpr double kStep_s = 0.02;
  static constexpr std::size_t kDelays = 21;
  /// Sums over turns of the wheels for one delay, decreasing with age.
  struct Sums {
    double wheels = 0, wheels2 = 0, product = 0;
  };
  static Duration delay_of(std::size_t i);
  [[nodiscard]] double covariance(std::size_t i) const;
  void choose();

  std::array<Sums, kDelays> sums_{};
  double scans_ = 0, matched_ = 0, matched2_ = 0;  // the same of the scans and of their turns
  std::size_t chosen_ = 0;
};

}  // namespace hm
