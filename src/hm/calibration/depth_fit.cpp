#include "hm/calibration/depth_fit.hpp"

#include <cmath>

#include "hm/calibration/spline_fit.hpp"

namespace hm {

Result<DepthFit> fit_depth_correction(std::span<const DepthView> views, int width, int height,
                                      const DepthFitParams& params) {
  constexpr double kLeastRangeRatio = 1.1;
  std::size_t samples = 0;
  for (const DepthView& view : views) samples += view.samples.size();
  if (samples < 100)
    return fail(ErrorCode::kInvalidValue, "", "{} readings of the board are too few for a correction",
                samples);
  DepthCorrectionModel model;
  model.mode = params.mode;
  model.width = width, model.height = height;
  const detail::TrainedRange range = detail::trained_range(views);
  if (!(range.max_m > kLeastRangeRatio * range.min_m))
    return fail(ErrorCode::kInvalidValue, "",
                "all boards are {:.2f} m away: show the board at the nearest, the farthest and some "
                "distances between",
                range.min_m);
  model.min_depth_m = range.min_m, model.max_depth_m = range.max_m;
  return params.mode == DepthFitMode::kSpline ? detail::fit_spline(views, std::move(model), params)
                                              : detail::fit_each_pixel(views, std::move(model), params);
}

DepthViewError evaluate_correction(const DepthView& view, const DepthCorrectionModel& model) {
  DepthViewError error;
  error.name = view.name;
  error.distance_m = view.distance_m;
  error.samples = view.samples.size();
  if (view.samples.empty()) return error;
  double before_squares = 0, after_squares = 0, noise = 0;
  for (const DepthSample& sample : view.samples) {
    const auto measured = static_cast<double>(sample.measured_m);
    const double before = measured - static_cast<double>(sample.true_m);
    const double after = before + model.correction_m(Vec2(sample.x, sample.y), measured);
    before_squares += before * before, after_squares += after * after;
    error.before_mean_m += before, error.after_mean_m += after;
    noise += static_cast<double>(sample.sigma_m) * static_cast<double>(sample.sigma_m);
  }
  const auto n = static_cast<double>(view.samples.size());
  error.before_rms_m = std::sqrt(before_squares / n), error.after_rms_m = std::sqrt(after_squares / n);
  error.before_mean_m /= n, error.after_mean_m /= n;
  error.noise_m = std::sqrt(noise / n);
  return error;
}

}  // namespace hm
