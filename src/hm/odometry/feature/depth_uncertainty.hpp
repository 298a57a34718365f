#pragma once
#include <array>
#include <optional>
#include <string_view>

#include "hm/core/params.hpp"
#include "hm/geometry/camera.hpp"
#include "hm/sensors/depth_noise.hpp"
#include "hm/sensors/rgbd_frame.hpp"

namespace hm {

/// Depth as a normal distribution.
struct DepthGaussian {
  double mean_m = 0;
  double variance_m2 = 0;
};

/// Weights of the readings in the 3x3 window around a pixel (dissertation 3.1.4): a feature's position is
/// known only to about one pixel, so its depth may be that of any pixel in the window.
struct MixtureWeights {
  double centre = 4, edge = 2, corner = 1;
};

/// Quadratic model: the reading itself, with the sensor's standard deviation at this depth (dissertation
/// 3.1.3). Nothing without a reading.
std::optional<DepthGaussian> quadratic_depth(const DepthImage& depth, int x, int y, const DepthNoise& noise);

/// Gaussian mixture of the valid readings in the 3x3 window around a pixel, as one Gaussian with the
/// mixture's mean and variance (dissertation 3.1.4): at a depth edge the standard deviation is about the
/// step. The variance is summed about the mean to avoid cancellation. The window is clipped at the image
/// border. Nothing if the pixel itself has no reading or lies outside.
std::optional<DepthGaussian> mixture_depth(const DepthImage& depth, int x, int y, const DepthNoise& noise,
                                           const MixtureWeights& weights = {});

/// The same with the sensor's noise counted once: the published mixture adds the sensor's noise to the
/// scatter of readings that already contains it, so that its standard deviation on a plane is a third too
/// large. Here only the scatter beyond that noise is added.
std::optional<DepthGaussian> corrected_mixture_depth(const DepthImage& depth, int x, int y,
                                                     const DepthNoise& noise,
                                                     const MixtureWeights& weights = {});

/// Model for the depth of a pixel and its standard deviation.
enum class DepthModel { kQuadratic, kMixture, kCorrectedMixture };
inline constexpr std::array<std::string_view, 3> kDepthModelNames{"quadratic", "mixture",
                                                                  "corrected_mixture"};
std::optional<DepthGaussian> depth_at(DepthModel model, const DepthImage& depth, int x, int y,
                                      const DepthNoise& noise);

/// Covariance (m^2, camera frame) of the point at a pixel and depth, for a pixel error of `pixel_sigma_px` in
/// both directions, independent of the depth (dissertation 3.2.1). The camera must have no lens distortion;
/// fy may be negative.
Mat3 feature_covariance(const PinholeCamera& camera, const Vec2& pixel, const DepthGaussian& depth,
                        double pixel_sigma_px = 1.0);

}  // namespace hm
