#include "hm/odometry/feature/depth_uncertainty.hpp"

#include <algorithm>
#include <array>

#include "hm/core/check.hpp"

namespace hm {

namespace {

struct PixelReading {
  double depth_m = 0, weight = 0;
};

/// Valid readings of the window around a pixel; their number is `size`.
struct PixelWindow {
  std::array<PixelReading, 9> readings;
  std::size_t size = 0;
};

PixelWindow valid_window(const DepthImage& depth, int x, int y, const MixtureWeights& weights) {
  PixelWindow window;
  for (int v = std::max(y - 1, 0); v <= std::min(y + 1, depth.height() - 1); ++v) {
    for (int u = std::max(x - 1, 0); u <= std::min(x + 1, depth.width() - 1); ++u) {
      const double z = depth.depth_m(u, v);
      if (z <= 0) continue;
      const bool same_column = u == x;
      const bool same_row = v == y;
      const double weight = same_column && same_row   ? weights.centre
                            : same_column || same_row ? weights.edge
                                                      : weights.corner;
      window.readings[window.size++] = {z, weight};
    }
  }
  return window;
}

/// Moments of the readings of a window: mean, mean sensor variance, variance about the mean, and sum of
/// squared normalised weights (for independent readings with equal noise, 1 minus this is the expected share
/// of scatter).
struct Moments {
  double mean_m = 0, noise_m2 = 0, scatter_m2 = 0, squared_shares = 0;
};

Moments moments_of(const PixelWindow& window, const DepthNoise& noise) {
  double sum_weight = 0, sum_squares = 0, sum_depth = 0;
  for (std::size_t i = 0; i < window.size; ++i) {
    sum_weight += window.readings[i].weight;
    sum_squares += window.readings[i].weight * window.readings[i].weight;
    sum_depth += window.readings[i].weight * window.readings[i].depth_m;
  }
  Moments moments{sum_depth / sum_weight, 0, 0, sum_squares / (sum_weight * sum_weight)};
  for (std::size_t i = 0; i < window.size; ++i) {
    const auto [z, weight] = window.readings[i];
    const double sigma = noise.sigma_m(z);
    moments.noise_m2 += weight * sigma * sigma / sum_weight;
    moments.scatter_m2 += weight * (z - moments.mean_m) * (z - moments.mean_m) / sum_weight;
  }
  return moments;
}

}  // namespace

std::optional<DepthGaussian> quadratic_depth(const DepthImage& depth, int x, int y, const DepthNoise& noise) {
  if (!depth.units.contains(x, y) || depth.units(x, y) == 0) return std::nullopt;
  const double z = depth.depth_m(x, y);
  const double sigma = noise.sigma_m(z);
  return DepthGaussian{z, sigma * sigma};
}

std::optional<DepthGaussian> mixture_depth(const DepthImage& depth, int x, int y, const DepthNoise& noise,
                                           const MixtureWeights& weights) {
  if (!depth.units.contains(x, y) || depth.units(x, y) == 0) return std::nullopt;
  const Moments moments = moments_of(valid_window(depth, x, y, weights), noise);
  return DepthGaussian{moments.mean_m, moments.noise_m2 + moments.scatter_m2};
}

std::optional<DepthGaussian> corrected_mixture_depth(const DepthImage& depth, int x, int y,
                                                     const DepthNoise& noise, const MixtureWeights& weights) {
  if (!depth.units.contains(x, y) || depth.units(x, y) == 0) return std::nullopt;
  const Moments moments = moments_of(valid_window(depth, x, y, weights), noise);
  const double beyond_noise = moments.scatter_m2 - moments.noise_m2 * (1 - moments.squared_shares);
  return DepthGaussian{moments.mean_m, moments.noise_m2 + std::max(beyond_noise, 0.0)};
}

std::optional<DepthGaussian> depth_at(DepthModel model, const DepthImage& depth, int x, int y,
                                      const DepthNoise& noise) {
  switch (model) {
    case DepthModel::kQuadratic:
      return quadratic_depth(depth, x, y, noise);
    case DepthModel::kMixture:
      return mixture_depth(depth, x, y, noise);
    case DepthModel::kCorrectedMixture:
      return corrected_mixture_depth(depth, x, y, noise);
  }
  HM_CHECK(false, "{}", static_cast<int>(model));
  return std::nullopt;
}

Mat3 feature_covariance(const PinholeCamera& camera, const Vec2& pixel, const DepthGaussian& depth,
                        double pixel_sigma_px) {
  const double variance = depth.variance_m2;
  const Vec3 ray((pixel.x() - camera.cx) / camera.fx, (pixel.y() - camera.cy) / camera.fy, 1.0);
  // E[z^2] rather than z^2: pixel and depth are uncertain at the same time.
  const double lateral = pixel_sigma_px * pixel_sigma_px * (depth.mean_m * depth.mean_m + variance);
  Mat3 covariance = variance * ray * ray.transpose();
  covariance(0, 0) += lateral / (camera.fx * camera.fx);
  covariance(1, 1) += lateral / (camera.fy * camera.fy);
  return covariance;
}

}  // namespace hm
