#pragma once
#include <vector>

#include "hm/pipeline/recording_check.hpp"
#include "hm/sensors/rgbd_frame.hpp"

namespace hm {

/// Finds the shift between colour and depth: sums the colour gradient found at depth edges for every shift of
/// up to kReach_px pixels. Where colour is registered the sum is largest at no shift.
class ColorShiftEstimator {
 public:
  static constexpr int kReach_px = 12;
  ColorShiftEstimator();
  /// Takes a frame into account; frames without colour say nothing.
  void add(const RgbdFrame& frame);
  /// The best shift so far; none, with gain 1, when there were too few edges.
  [[nodiscard]] ColorShift best() const;

 private:
  static constexpr int kSide = 2 * kReach_px + 1;
  std::vector<double> sums_;
  std::size_t edges_ = 0;
};

}  // namespace hm
