#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "hm/core/aligned_vector.hpp"
#include "hm/depth_camera/depth_correction.hpp"
#include "hm/depth_camera/narrow_kernels.hpp"

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

  int width_ = 0, height_ = 0, terms_ = 0, stride_ = 0;
  double min_depth_m_ = 0, max_depth_m_ = 0;
  double range_m_ = 0;  ///< what 2^15 stands for
  /// [row][term][column]: of a spline, of every so many rows and of the last one; of pixels, of all rows.
  AlignedVector<std::int16_t> coefficients_;
  int rows_apart_ = 1;
  std::vector<std::int16_t> weights_;                 ///< of a spline: for each row, of the next coefficients
  AlignedVector<std::int16_t> lowest_s_, highest_s_;  ///< of pixels: [row][column]
};

}  // namespace hm::detail
