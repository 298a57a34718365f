#include "hm/odometry/depth_uncertainty.hpp"

#include <algorithm>
#include <array>

namespace hm {

namespace {

struct Reading {
  double depth_m = 0, weight = 0;
};

/// The valid readings of the window around a pixel; count in `size`.
struct Window {
  std::array<Reading, 9> readings;
  std::size_t size = 0;
};

Window valid_window(const DepthImage& depth, int x, int y, const MixtureWeights& weights) {
  Window window;
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
  const Window window = valid_window(depth, x, y, weights);
  double sum_weight = 0;
  double sum_depth = 0;
  for (std::size_t i = 0; i < window.size; ++i) {
    sum_weight += window.readings[i].weight;
    sum_depth += window.readings[i].weight * window.readings[i].depth_m;
  }
  const double mean = sum_depth / sum_weight;
  double sum_variance = 0;
  for (std::size_t i = 0; i < window.size; ++i) {
    const auto [z, weight] = window.readings[i];
    const double sigma = noise.sigma_m(z);
    sum_variance += weight * (sigma * sigma + (z - mean) * (z - mean));
  }
  return DepthGaussian{mean, sum_variance / sum_weight};
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
