#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "hm/sensors/depth_correction.hpp"
#include "hm/sensors/narrow_kernels.hpp"

namespace hm::detail {

/// A correction in whole numbers of 16 bits (2^-15 of a range that holds every sum on the way), twice as many
/// to a register as floats: within 0.1 mm of the model, the same on every CPU.
class NarrowCorrection {
 public:
  /// Nothing when the model's numbers are too large to be within 0.1 mm.
  static std::optional<NarrowCorrection> make(const DepthCorrectionModel& model, int width, int height);
  /// Nothing when readings of this unit do not fit.
  [[nodiscard]] std::optional<NarrowScale> scale_for(double unit_m) const;
  /// What a row is corrected with.
  [[nodiscard]] NarrowRow row(int y) const;

 private:
  NarrowCorrection() = default;
  bool make_spline(const DepthCorrectionModel& model);
  bool make_pixels(const DepthCorrectionModel& model);

  int width_ = 0, height_ = 0, terms_ = 0;
  double min_depth_m_ = 0, max_depth_m_ = 0;
  double range_m_ = 0;               ///< what 2^15 stands for
  std::vector<int> span_begin_;      ///< of a spline: first pixel of each span of columns, and the width
  std::vector<std::int16_t> place_;  ///< of a spline: of each column within its span, 2^-15
  std::vector<std::int16_t> coefficients_;  ///< [row][span][term][power 3 .. 0], or [row][term][column]
  std::vector<std::int16_t> lowest_s_, highest_s_;  ///< of each pixel; empty for a spline
};

}  // namespace hm::detail
