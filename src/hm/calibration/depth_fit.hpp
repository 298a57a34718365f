#pragma once
#include <span>

#include "hm/calibration/depth_reference.hpp"
#include "hm/depth_camera/depth_correction.hpp"

namespace hm {

/// Parameters refined together with the correction.
enum class DepthRefine { kNone, kCameras };
inline constexpr std::string_view kDepthRefineNames[] = {"none", "cameras"};

struct DepthFitParams {
  DepthFitMode mode = DepthFitMode::kSpline;
  int columns = 16, rows = 12;
  int degree = 2;
  double smoothness_m = 0.003;
  /// Edge of the square of readings that each pixel's polynomial is fitted to; larger is smoother.
  int window_px = 21;
  double gate_m = 0.5;
  /// Every n-th pose is held out for testing when there is no folder test/.
  static constexpr int kHoldOutEvery = 4;
  DepthRefine refine = DepthRefine::kNone;
  /// Refine: prior standard deviation of focal lengths and principal points.
  double prior_intrinsics_px = 1;
  /// Refine: prior standard deviation of the translation between the cameras.
  double prior_translation_m = 0.001;
  /// Refine: prior standard deviation of the rotation between the cameras.
  double prior_rotation_rad = 0.001;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"mode",
               {},
               "spline: smooth over the image; others: the dissertation's polynomial for each pixel"},
      self.mode, kDepthFitModeNames);
    v(ParamDoc{"columns", {4, 64}, "control points of the spline along a row"}, self.columns);
    v(ParamDoc{"rows", {4, 64}, "control points of the spline along a column"}, self.rows);
    v(ParamDoc{"degree", {0, 3}, "degree of the spline's polynomial in depth"}, self.degree);
    v(ParamDoc{"smoothness_m",
               {1e-6, 10},
               "standard deviation of control points from the plane through their neighbours; smaller is "
               "smoother"},
      self.smoothness_m);
    v(ParamDoc{"gate_m", {0.01, 10}, "readings farther from the board's plane are ignored"}, self.gate_m);
    v(ParamDoc{"refine",
               {},
               "cameras: intrinsics and the transform between the cameras are refined together with board "
               "poses and correction"},
      self.refine, kDepthRefineNames);
  }
};

struct DepthFit {
  DepthCorrectionModel model;
  std::size_t samples = 0;        ///< used by the fit
  double fitted_pixel_ratio = 0;  ///< pixels with enough samples (pixel modes), or spline cells with samples
};

/// Fits a depth correction to views of a board (dissertation 3.1.2); width and height of the depth image in
/// pixels. Errors: no samples, or all at one distance.
Result<DepthFit> fit_depth_correction(std::span<const DepthView> views, int width, int height,
                                      const DepthFitParams& params = {});

/// RMS and mean of a view's residuals (measured minus true) before and after a correction.
struct DepthViewError {
  std::string name;
  double distance_m = 0;
  std::size_t samples = 0;
  double before_rms_m = 0, after_rms_m = 0;
  double before_mean_m = 0, after_mean_m = 0;
  /// RMS of the samples' expected noise, a lower bound of the corrected error; 0 if unknown.
  double noise_m = 0;
};
DepthViewError evaluate_correction(const DepthView& view, const DepthCorrectionModel& model);

}  // namespace hm
