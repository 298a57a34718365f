#pragma once
#include <cstdint>

#include "hm/depth_camera/depth_correction.hpp"

/// The inner loops of DepthCorrection in single precision, for several instruction sets.
namespace hm::detail {

/// Coefficients and ranges of s along a row of an image.
struct RowTerms {
  const float* term[DepthCorrectionModel::kMaxTerms];
  const float* low;
  const float* high;
};

/// Pixels of a row that are corrected together.
inline constexpr int kBlock = 16;

/// Numbers of one image that are the same for all of its readings.
struct RowScale {
  float s_factor, s_offset;  ///< units to s
  float units_per_m;
  int lowest, highest;  ///< units within the trained range
};

/// Consecutive pixels of a row that the same control points belong to.
struct SpanShape {
  int count;
  float t0, step;  ///< place of the first pixel within the span of the spline, and from one to the next
};

/// The same code for several instruction sets: without fused operations, so that the bits are the same.
struct Kernels {
  void (*row)(std::uint16_t*, int, const RowTerms&, const RowScale&);
  void (*span)(const std::uint16_t*, std::uint16_t*, const SpanShape&, const float*, const RowScale&);
};

/// The fastest ones for this CPU and number of terms.
const Kernels& kernels_for(int terms);

}  // namespace hm::detail
