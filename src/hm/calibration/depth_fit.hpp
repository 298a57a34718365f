#pragma once
#include <span>

#include "hm/calibration/depth_reference.hpp"
#include "hm/depth_camera/depth_correction.hpp"

namespace hm {

/// What is fitted along with the correction.
enum class DepthRefine { kNone, kCameras };
inline constexpr std::string_view kDepthRefineNames[] = {"none", "cameras"};

struct DepthFitParams {
  DepthFitMode mode = DepthFitMode::kSpline;
  int columns = 16, rows = 12;
  int degree = 2;
  double smoothness_m = 0.003;
  int window_px = 21;
  double gate_m = 0.5;
  /// Every so many-th pose is for testing, where no folder test/ is given.
  static constexpr int kHoldOutEvery = 4;
  DepthRefine refine = DepthRefine::kNone;
  double prior_intrinsics_px = 1;
  double prior_translation_m = 0.001;
  double prior_rotation_rad = 0.001;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"mode", {}, "spline: smooth; the others: the dissertation's polynomial for each pixel"},
      self.mode, kDepthFitModeNames);
    v(ParamDoc{"columns", {4, 64}, "control points of the spline along a row"}, self.columns);
    v(ParamDoc{"rows", {4, 64}, "control points of the spline along a column"}, self.rows);
    v(ParamDoc{"degree", {0, 3}, "of the spline's polynomial in depth"}, self.degree);
    v(ParamDoc{"smoothness_m",
               {1e-6, 10},
               "how much control points may differ from a plane through their neighbours"},
      self.smoothness_m);
    v(
        ParamDoc{
            "window_px", {1, 101}, "edge of the square whose readings each pixel's polynomial is fitted to"},
        self.window_px);
    v(ParamDoc{"gate_m", {0.01, 10}, "readings farther from the board's plane are something else"},
      self.gate_m);
    v(
        ParamDoc{
            "refine",
            {},
            "cameras: focal lengths, centres and the motion between the cameras are adjusted together with "
            "the boards and the correction"},
        self.refine, kDepthRefineNames);
    v(ParamDoc{"prior_intrinsics_px", {1e-3, 100}, "refine: how well focal lengths and centres are known"},
      self.prior_intrinsics_px);
    v(ParamDoc{"prior_translation_m", {1e-6, 1}, "refine: how well the distance of the cameras is known"},
      self.prior_translation_m);
    v(ParamDoc{"prior_rotation_rad", {1e-6, 1}, "refine: how well the rotation between them is known"},
      self.prior_rotation_rad);
  }
};

struct DepthFit {
  DepthCorrectionModel model;
  std::size_t samples = 0;  ///< that the fit used
  double fitted_pixel_ratio =
      0;  ///< pixels with enough samples (of a pixel mode), or cells of the spline with any
};

/// Fits a correction to views of a board. Errors: no samples, or all at one distance.
Result<DepthFit> fit_depth_correction(std::span<const DepthView> views, int width, int height,
                                      const DepthFitParams& params = {});

/// RMS of a view's residuals (measured minus true), before and after a correction.
struct DepthViewError {
  std::string name;
  double distance_m = 0;
  std::size_t samples = 0;
  double before_rms_m = 0, after_rms_m = 0;
  double before_mean_m = 0, after_mean_m = 0;
  /// RMS of the samples' expected deviation, what no correction can take away; 0 where single images tell
  /// none.
  double noise_m = 0;
};
DepthViewError evaluate_correction(const DepthView& view, const DepthCorrectionModel& model);

}  // namespace hm
