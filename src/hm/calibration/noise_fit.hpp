#pragma once
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hm/calibration/depth_average.hpp"
#include "hm/sensors/depth_noise.hpp"

namespace hm {

/// Standard deviation of readings at a depth, a data point for fitting a noise model.
struct NoiseSample {
  double depth_m = 0, sigma_m = 0;
  double weight = 1;  ///< number of readings
};

struct NoiseFitParams {
  /// Width of a depth bin, metres.
  static constexpr double kBin_m = 0.1;
  /// Bins with fewer readings are ignored.
  int min_readings = 200;
  /// Nearest depth used.
  double min_depth_m = 0.2;
  /// Farthest depth used.
  double max_depth_m = 10;
};

/// Histogram of standard deviations over depth.
class NoiseHistogram {
 public:
  explicit NoiseHistogram(const NoiseFitParams& params = {});
  /// Adds the temporal standard deviation of every pixel of a static scene. Pixels with few readings and
  /// pixels at depth edges (whose readings alternate between two surfaces) are ignored.
  void add_static(const DepthAverage& average);
  /// Adds the deviation of one image's readings from a plane fitted to its central part, blockwise, so that a
  /// smooth bias has no effect. Does nothing when no plane is found.
  void add_plane(const DepthImage& depth);
  /// Standard deviation of each bin with enough readings, by increasing depth.
  [[nodiscard]] std::vector<NoiseSample> samples() const;

 private:
  struct Bin {
    double depth_sum = 0, variance_sum = 0;
    double weight = 0;
  };
  void add(double depth_m, double variance_m2, double weight);
  NoiseFitParams params_;
  std::vector<Bin> bins_;
};

struct NoiseFit {
  DepthNoise noise;
  double rms_relative = 0;  ///< RMS of (sample - fit) / fit
};

/// Fits sigma(z) = quadratic z^2 + linear z + constant to the samples, minimising the relative error, with
/// quadratic and constant not below 0. Error with fewer than three samples.
Result<NoiseFit> fit_noise(std::span<const NoiseSample> samples);

}  // namespace hm
