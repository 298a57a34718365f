#pragma once
#include "hm/calibration/depth_fit.hpp"

/// The two kinds of fit of fit_depth_correction().
namespace hm::detail {

/// Mean of one view's readings in a square of pixels.
struct BlockMean {
  Vec2 pixel = Vec2::Zero();
  double measured_m = 0, error_m = 0;  ///< error: true minus measured
  double sigma_m = 0;
};
std::vector<BlockMean> block_means(const DepthView& view, int block_px);

/// Trained depth range: the range of readings without the outermost 0.1 % at each end.
struct TrainedRange {
  double min_m = 0, max_m = 0;
};
TrainedRange trained_range(std::span<const DepthView> views);

DepthFit fit_spline(std::span<const DepthView> views, DepthCorrectionModel model,
                    const DepthFitParams& params);
DepthFit fit_each_pixel(std::span<const DepthView> views, DepthCorrectionModel model,
                        const DepthFitParams& params);

}  // namespace hm::detail
