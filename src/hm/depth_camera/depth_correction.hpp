#pragma once
#include <cstdint>
#include <string_view>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/depth_camera/aligned_vector.hpp"
#include "hm/geometry/se3.hpp"
#include "hm/sensors/rgbd_frame.hpp"

namespace hm {

/// Form of a depth correction: a smooth spline, or the dissertation's polynomials for each pixel (3.1.2).
enum class DepthFitMode { kSpline, kLinear, kLinearZero, kQuadratic, kQuadraticZero };
inline constexpr std::string_view kDepthFitModeNames[] = {"spline", "linear", "linear_zero", "quadratic",
                                                          "quadratic_zero"};

/// Depth bias of a camera over its (rectified) image and over depth. The correction added to a reading of d
/// metres is
///
///     sum_k c_k(x, y) s^k,   s = (2 d - min - max) / (max - min), with s clamped to the trained range.
///
/// kSpline: c_k are uniform bicubic B-splines with columns x rows control points; control point (i, j) has
/// its peak at ((i - 1) width / (columns - 3) - 0.5, (j - 1) height / (rows - 3) - 0.5) px. All other modes:
/// one set of coefficients for each pixel (columns = width, rows = height), each with a range of s of its
/// own.
struct DepthCorrectionModel {
  static constexpr int kMaxTerms = 4;

  DepthFitMode mode = DepthFitMode::kSpline;
  int width = 0, height = 0;  ///< of the image that it was fitted on
  int columns = 0, rows = 0;
  int terms = 0;                            ///< of the polynomial: its degree plus one
  double min_depth_m = 0, max_depth_m = 0;  ///< trained range of readings
  std::vector<float> coefficients;          ///< metres; plane by plane: [term][row][column]
  std::vector<float> lowest_s, highest_s;   ///< of each pixel; empty for kSpline, where they are -1 and 1

  /// Correction to add to a reading at a pixel, metres. Reference implementation in double precision.
  [[nodiscard]] double correction_m(const Vec2& pixel, double depth_m) const;
};

/// Checks a model; error when sizes, ranges or coefficients are invalid.
Result<void> check_model(const DepthCorrectionModel& model);

/// Applies a model to depth images in single precision, with bit-identical results on every CPU. Const
/// members are thread-safe.
class DepthCorrection {
 public:
  /// Prepares images of this size in pixels, which may be the model's scaled by a common ratio.
  DepthCorrection(const DepthCorrectionModel& model, int width, int height);
  /// Corrects every reading in place; 0 (no reading) stays 0, results are rounded and clamped to 1 .. 65535.
  void apply(DepthImage& depth) const;

 private:
  void resample_spline(const DepthCorrectionModel& model);
  void resample_pixels(const DepthCorrectionModel& model);
  int width_, height_;
  int columns_;  ///< the width rounded up to whole blocks
  int terms_;
  double min_depth_m_, max_depth_m_;
  int table_rows_;  ///< control points of a spline from top to bottom, or the height
  bool is_spline_;
  AlignedVector<float> tables_;                ///< [row][term][column]: coefficients at the image's columns
  AlignedVector<float> lowest_s_, highest_s_;  ///< [row][column]; a spline has one row
};

}  // namespace hm
