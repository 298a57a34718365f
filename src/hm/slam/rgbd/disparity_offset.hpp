#pragma once
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>

#include "hm/slam/rgbd/surface_calibration.hpp"

namespace hm {

/// Offset of a depth camera's disparity: 1 / depth = 1 / reading + offset_1_m, up to the scale of all depths,
/// which is not observable. Positive: near surfaces read too short compared with far ones.
struct DisparityOffset {
  /// Standard deviation of the prior, whose mean is zero, 1/m: 2 % of depth at 1 m.
  static constexpr double kPriorSigma_1_m = 0.02;
  double offset_1_m = 0;
  double sigma_1_m = kPriorSigma_1_m;
  std::size_t pairs = 0;  ///< of depth images, compared
  /// False: the surfaces show hardly more than the prior, agree worse with an offset, or the estimate did not
  /// converge; offset and deviation are then the prior's, and the costs equal.
  bool is_observed = false;
  /// Mean robust cost (Cauchy) of the distances between the surfaces, with the offset over without, each with
  /// its own motions.
  double cost_ratio = 1;
  bool interrupted = false;  ///< stopped by the caller: not observed

  /// Surfaces agree much better with it, not only significantly: rolling shutter and lens distortion look
  /// like an offset too. (0.77 to 0.83 in simulated rooms with an offset of 0.02 1/m, 0.92 to 0.97 with
  /// 0.01.)
  [[nodiscard]] bool is_worth_a_calibration() const {
    constexpr double kSignificant_sigmas = 3, kMost_cost_ratio = 0.9;
    return std::abs(offset_1_m) > kSignificant_sigmas * sigma_1_m && cost_ratio < kMost_cost_ratio;
  }
};

/// Nothing where the image has no reading.
std::optional<SurfaceResidual> offset_residual(const SurfacePair& pair, const SurfaceElement& element,
                                               double offset_1_m, const DepthNoise& noise);

/// Self-calibration of the disparity of a depth camera (calibrate_by_surfaces()): a wall remains a plane with
/// a wrong offset, but turns with the distance it is seen from. Depth that is bent over the image spoils the
/// estimate. If `run` is stopped, there is none.
///
/// As an unknown of the bundle adjustment it would be found from features, whose errors (rolling shutter,
/// matching) look like an offset: 0.018 1/m on fr1/xyz, whose trajectory is best with readings corrected by
/// 0 to 0.01, and a scale of 1.17 on fr1/rpy.
DisparityOffset estimate_disparity_offset(std::span<const SurfacePair> pairs, const DepthNoise& noise,
                                          const RunContext& run = {});

}  // namespace hm
