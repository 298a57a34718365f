#include "hm/sim/sensor/depth_sensor.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace hm {
namespace {

/// Standard normal numbers from 32 random bits by the quantile function, linear between 4096 nodes and scaled
/// to unit variance. Symmetric, so exactly unbiased; about ten times faster than Box-Muller.
class NormalTable {
 public:
  NormalTable() {
    for (std::size_t i = 0; i <= kCells / 2; ++i) {
      const double value = i == 0 ? -4.0 : quantile(static_cast<double>(i) / kCells);
      nodes_[i] = value;
      nodes_[kCells - i] = -value;
    }
    double variance = 0;
    for (std::size_t i = 0; i < kCells; ++i) {
      const double a = nodes_[i], b = nodes_[i + 1];
      variance += (a * a + a * b + b * b) / (3.0 * kCells);
    }
    for (double& node : nodes_) node /= std::sqrt(variance);
  }
  double operator()(std::uint32_t bits) const {
    const std::size_t cell = bits >> 20u;
    const double fraction = (static_cast<double>(bits & 0xfffffu) + 0.5) / 1048576.0;
    return nodes_[cell] + fraction * (nodes_[cell + 1] - nodes_[cell]);
  }
  /// Normal deviate of 16 random bits, at the centre of the 32-bit values that start with them.
  double from_half(std::uint32_t bits16) const { return (*this)((bits16 << 16u) | 0x8000u); }

 private:
  static constexpr std::size_t kCells = 4096;
  static double quantile(double p) {
    double low = -9, high = 9;
    for (int i = 0; i < 60; ++i) {
      const double middle = 0.5 * (low + high);
      (0.5 * std::erfc(-middle / std::numbers::sqrt2) < p ? low : high) = middle;
    }
    return 0.5 * (low + high);
  }
  std::array<double, kCells + 1> nodes_{};
};

const NormalTable& normal_table() {
  static const NormalTable table;
  return table;
}

/// Axial standard deviation at depth z on a surface seen at this cosine (Nguyen et al. 2012, eq. 3).
double axial_sigma(const DepthNoise& noise, double z, double cosine) {
  double sigma = noise.sigma_m(z);
  if (cosine < 0.5) {
    const double theta = std::acos(std::max(cosine, 0.03));
    const double ratio = theta / (std::numbers::pi / 2 - theta);
    sigma += 1e-4 / std::sqrt(z) * ratio * ratio;
  }
  return sigma;
}

struct Pixel {
  int x = 0, y = 0;
};

/// Nearest integer for |value| < 1e9; rounding by truncation is inlined, unlike std::round.
int rounded(double value) { return static_cast<int>(value + (value < 0 ? -0.5 : 0.5)); }

/// Source of a pixel's reading: the pixel itself, or at a depth edge a pixel at a random offset.
Pixel lateral_source(const NormalTable& normal, double sigma_px, const Image<float>& depth_m, Pixel at,
                     std::uint32_t bits) {
  const int dx = rounded(sigma_px * normal.from_half(bits >> 16u));
  const int dy = rounded(sigma_px * normal.from_half(bits & 0xffffu));
  const Pixel from{at.x + dx, at.y + dy};
  if ((dx == 0 && dy == 0) || !depth_m.contains(from.x, from.y)) return at;
  const float here = depth_m(at.x, at.y), there = depth_m(from.x, from.y);
  const bool edge = std::abs(here - there) > 0.02f + 0.04f * std::min(here, there);
  return edge ? from : at;
}

double quantised(double z, double step_m) {
  const int disparity = rounded(step_m / z);
  return disparity > 0 ? step_m / disparity : 0.0;
}

/// Sums over up to 2 `radius` + 1 pixels along a row of `length` pixels that lie `stride` apart.
void sum_along(const float* from, float* to, int length, std::ptrdiff_t stride, int radius) {
  for (int i = 0; i < length; ++i) {
    float sum = 0;
    for (int k = std::max(0, i - radius); k <= std::min(length - 1, i + radius); ++k) sum += from[k * stride];
    to[i * stride] = sum;
  }
}

/// Standard normal noise in which neighbours are alike (SensorModel::correlated_noise), from the axial
/// numbers that `rng` will give.
Image<float> correlated_noise(const NormalTable& normal, int width, int height, Rng rng) {
  constexpr int kRadiusX = 4, kRadiusY = 2;
  constexpr float kOwnWeight = 3;
  Image<float> own(width, height), rows(width, height), noise(width, height);
  for (float& value : own.pixels()) {
    rng.next_u32();  // for the lateral noise
    value = static_cast<float>(normal(rng.next_u32()));
  }
  for (int y = 0; y < height; ++y) sum_along(&own(0, y), &rows(0, y), width, 1, kRadiusX);
  for (int x = 0; x < width; ++x) sum_along(&rows(x, 0), &noise(x, 0), height, width, kRadiusY);
  const auto in_window = [](int at, int length, int radius) {
    return std::min(length - 1, at + radius) - std::max(0, at - radius) + 1;
  };
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const int count = in_window(x, width, kRadiusX) * in_window(y, height, kRadiusY);
      const float variance = static_cast<float>(count) + 2 * kOwnWeight + kOwnWeight * kOwnWeight;
      noise(x, y) = (noise(x, y) + kOwnWeight * own(x, y)) / std::sqrt(variance);
    }
  return noise;
}

}  // namespace

SensorEffects SensorEffects::none() {
  SensorEffects effects;
  effects.axial_noise = effects.lateral_noise = effects.quantisation = effects.depth_bias = false;
  effects.grazing_dropout = effects.material_dropout = false;
  return effects;
}

SensorModel sensor_model(SensorPreset preset) {
  SensorModel sensor;
  if (preset == SensorPreset::kKinect) {
    sensor.camera = {640, 480, 525, 525, 319.5, 239.5, {}};
    sensor.lateral_sigma_px = 0.8;
    sensor.disparity_step_m = 8 * 580.0 * 0.075;  // eighths of a pixel, 580 px focal length, 7.5 cm baseline
    return sensor;
  }
  sensor.camera = {320, 180, 260, 260, 159.5, 89.5, {}};
  sensor.rate_hz = 5;
  sensor.max_depth_m = 4;
  sensor.noise = {0.0028, -0.00224, 0.002948};  // 0.0025 + 0.0028 (z - 0.4)^2: about twice the Kinect's
  sensor.lateral_sigma_px = 0.6;
  sensor.bias_at_3m_m = preset == SensorPreset::kTangoPhone ? 0.3 : 0.0;
  return sensor;
}

double depth_bias_m(const SensorModel& sensor, int x, int y, double depth_m) {
  const double u = 2.0 * x / (sensor.camera.width - 1) - 1, v = 2.0 * y / (sensor.camera.height - 1) - 1;
  const double share = u * u + v * v - 1;  // -1 in the middle of the image, 1 in its corners
  const double z = depth_m / 3;
  return sensor.bias_at_3m_m * share * (0.75 * z + 0.25) * z;
}

DepthImage sense_depth(const SensorModel& sensor, const SensorEffects& effects, const RenderedView& view,
                       Rng& rng) {
  const NormalTable& normal = normal_table();
  const double least_cosine = effects.grazing_dropout ? std::cos(effects.grazing_limit_rad) : 0.0;
  DepthImage depth{Image<std::uint16_t>(view.depth_m.width(), view.depth_m.height()), kSimulatedDepthUnit_m};
  const bool biased = effects.depth_bias && sensor.bias_at_3m_m != 0;
  const Image<float> correlated =
      sensor.correlated_noise ? correlated_noise(normal, depth.width(), depth.height(), rng) : Image<float>();
  for (int y = 0; y < depth.height(); ++y) {
    for (int x = 0; x < depth.width(); ++x) {
      // Every pixel draws two numbers, so that enabling one effect does not change the noise of another.
      const std::uint32_t lateral_bits = rng.next_u32(), axial_bits = rng.next_u32();
      Pixel from{x, y};
      if (effects.lateral_noise)
        from = lateral_source(normal, sensor.lateral_sigma_px, view.depth_m, from, lateral_bits);
      const double truth = static_cast<double>(view.depth_m(from.x, from.y));
      const double cosine = static_cast<double>(view.cos_incidence(from.x, from.y));
      // Range limits apply to the true depth: applied to the reading they would bias the rest.
      if (truth < sensor.min_depth_m || truth > sensor.max_depth_m || cosine < least_cosine) continue;
      if (effects.material_dropout && view.returns[view.part(from.x, from.y)] == Reflectance::kNoReturn)
        continue;
      double z = truth;
      if (biased) z += depth_bias_m(sensor, x, y, truth);
      z /= 1 + sensor.short_at_1m_ratio * (1.5 - 0.5 * truth);
      if (effects.axial_noise) {
        const double noise =
            sensor.correlated_noise ? static_cast<double>(correlated(x, y)) : normal(axial_bits);
        z += effects.kNoiseScaleRatio * axial_sigma(sensor.noise, truth, cosine) * noise;
      }
      if (effects.quantisation && sensor.disparity_step_m > 0 && z > 0)
        z = quantised(z, sensor.disparity_step_m);
      const int units = rounded(z / depth.unit_m);
      if (units >= 1 && units <= 65534) depth.units(x, y) = static_cast<std::uint16_t>(units);
    }
  }
  return depth;
}

}  // namespace hm
