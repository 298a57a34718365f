#pragma once
#include <array>
#include <optional>
#include <string_view>

#include "hm/core/params.hpp"
#include "hm/geometry/camera.hpp"
#include "hm/sensors/depth_noise.hpp"
#include "hm/sensors/rgbd_frame.hpp"

namespace hm {

/// A depth as a normal distribution, metres and square metres.
struct DepthGaussian {
  double mean_m = 0;
  double variance_m2 = 0;
};

/// How much the readings around a pixel count for its depth (dissertation 3.1.4): a feature's pixel is known
/// to about one pixel only, so that the depth is one of a 3x3 window's.
struct MixtureWeights {
  double centre = 4, edge = 2, corner = 1;
};

/// The quadratic model: the reading itself, with the deviation of the sensor at this depth (dissertation
/// 3.1.3). Nothing where there is no reading.
std::optional<DepthGaussian> quadratic_depth(const DepthImage& depth, int x, int y, const DepthNoise& noise);

/// The Gaussian mixture of the valid readings in the 3x3 window around a pixel, as one Gaussian with the
/// mixture's mean and variance (dissertation 3.1.4): at an edge the deviation is about the jump. The variance
/// is summed around the mean, so that nothing cancels. The window ends at the image's border. Nothing where
/// the pixel itself has no reading or lies outside.
std::optional<DepthGaussian> mixture_depth(const DepthImage& depth, int x, int y, const DepthNoise& noise,
                                           const MixtureWeights& weights = {});

/// mixture_depth() with the sensor's noise counted once: the readings of the published mixture scatter by
/// their own noise already, to which it adds that noise again, so that on a plane its deviation is a third
/// too large. Here the scatter counts as far as it exceeds what the noise explains.
std::optional<DepthGaussian> corrected_mixture_depth(const DepthImage& depth, int x, int y,
                                                     const DepthNoise& noise,
                                                     const MixtureWeights& weights = {});

/// How the depth of a pixel and its deviation are found.
enum class DepthModel { kQuadratic, kMixture, kCorrectedMixture };
inline constexpr std::array<std::string_view, 3> kDepthModelNames{"quadratic", "mixture",
                                                                  "corrected_mixture"};
std::optional<DepthGaussian> depth_at(DepthModel model, const DepthImage& depth, int x, int y,
                                      const DepthNoise& noise);

/// The covariance (m^2, camera frame) of the point that `pixel` sees at a depth, for a pixel known to
/// `pixel_sigma_px` in both directions and independent of the depth (dissertation 3.2.1). The camera must be
/// free of lens distortion; fy may be negative.
Mat3 feature_covariance(const PinholeCamera& camera, const Vec2& pixel, const DepthGaussian& depth,
                        double pixel_sigma_px = 1.0);

}  // namespace hm
