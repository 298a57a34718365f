#pragma once
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>

#include "hm/slam/rgbd/surface_calibration.hpp"

namespace hm {

/// By how much the focal length of a depth camera seems to be wrong.
struct FocalLengthCheck {
  /// Standard deviation of the prior of log(ratio), whose mean is zero.
  static constexpr double kPriorSigma = 0.1;
  double ratio = 1;  ///< true focal length over the one that was given
  double sigma = kPriorSigma;
  std::size_t pairs = 0;     ///< of depth images, compared
  bool is_observed = false;  ///< converged, with a deviation under half of the prior's
  /// Mean robust cost (Cauchy) of the distances between the surfaces, with the ratio over without, each with
  /// its own motions.
  double cost_ratio = 1;
  bool interrupted = false;  ///< stopped by the caller: not observed

  /// Surfaces agree clearly better with another one. (Real recordings with intrinsics in use, of which
  /// rolling shutter, registration and lens take their share: ratios of 0.963 to 1.058, costs of 0.976 to
  /// 0.989; the same with focal lengths 15 % off: 0.859 to 0.927 or 1.108 to 1.195, costs of 0.814 to 0.957.)
  [[nodiscard]] bool seems_wrong() const {
    constexpr double kSignificant_sigmas = 3, kLeastLogRatio = 0.065, kMost_cost_ratio = 0.965;
    const double off = std::abs(std::log(ratio));
    return is_observed && off > kSignificant_sigmas * sigma && off > kLeastLogRatio &&
           cost_ratio < kMost_cost_ratio;
  }
};

/// Nothing where the image has no reading.
std::optional<SurfaceResidual> focal_length_residual(const SurfacePair& pair, const SurfaceElement& element,
                                                     double log_ratio, const DepthNoise& noise);

/// Compares the surfaces of pairs of depth images with other focal lengths (calibrate_by_surfaces()): with a
/// wrong one, x and y of all points are stretched and depth is not, so that what turns in front of the camera
/// changes its shape. Only turns show it: a camera that is moved without being turned sees a stretched room,
/// which nothing contradicts.
FocalLengthCheck check_focal_length(std::span<const SurfacePair> pairs, const DepthNoise& noise,
                                    const RunContext& run = {});

}  // namespace hm
