#pragma once
#include "hm/geometry/se2.hpp"

namespace hm {

/// The errors of wheel odometry, learned from the motions that scan matching found instead: those that the
/// wheels always make (their scale, a heading that veers to one side) and the deviations of the rest.
///
/// Motions are planar, of the base, in the base frame before them. Errors along and across the motion grow
/// with the root of the way, those of the heading with the roots of the way and of the turn. A measured
/// motion counts by its covariance, so that one along a corridor teaches nothing about the way. Outliers
/// (a wheel that slips) count little.
class WheelCalibration {
 public:
  /// A motion that the wheels measured, without what they always err by.
  [[nodiscard]] SE2 corrected(const SE2& wheels) const;
  /// Covariance of (x, y, angle) of corrected(wheels): m, rad.
  [[nodiscard]] Mat3 covariance(const SE2& wheels) const;
  /// Learns from a motion that matching found, with the covariance of (x, y, angle) of it.
  void learn(const SE2& wheels, const SE2& matched, const Mat3& covariance);

  /// Ratio by which distances are measured too short.
  [[nodiscard]] double scale_error() const { return scale_; }
  /// Heading that is missing per metre, rad/m.
  [[nodiscard]] double veer_rad_m() const { return heading_.x(); }

 private:
  /// A deviation that is learned, per root of a unit: its variance, and the number of motions behind it.
  struct Spread {
    double variance;
    double count;
    void learn(double error2, double amount);
  };
  /// Motions that the deviations below are worth.
  static constexpr double kPriorCount = 3;

  double scale_ = 0, scale_variance_ = 0.05 * 0.05;
  Vec2 heading_ = Vec2::Zero();  // rad/m of the way, ratio of the turn
  Mat2 heading_covariance_ = Vec2(0.1 * 0.1, 0.05 * 0.05).asDiagonal();
  Spread along_{0.07 * 0.07, kPriorCount}, across_{0.07 * 0.07, kPriorCount};  // m2 per metre
  Spread veering_{0.1 * 0.1, kPriorCount};                                     // rad2 per metre
  Spread turning_{0.1 * 0.1, kPriorCount};                                     // rad2 per radian
};

}  // namespace hm
