#pragma once
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hm/calibration/depth_average.hpp"
#include "hm/sensors/depth_noise.hpp"

namespace hm {

/// Deviation of readings at a distance: what a sensor's noise is fitted to.
struct NoiseSample {
  double depth_m = 0, sigma_m = 0;
  double weight = 1;  ///< readings behind it
};

struct NoiseFitParams {
  /// Readings are gathered in steps of depth.
  static constexpr double kBin_m = 0.1;
  /// Steps with fewer readings are left out.
  int min_readings = 200;
  double min_depth_m = 0.2, max_depth_m = 10;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"min_depth_m", {0, 100}, "nearest readings that are used"}, self.min_depth_m);
    v(ParamDoc{"max_depth_m", {0.1, 100}, "farthest readings that are used"}, self.max_depth_m);
  }
};

/// Gathers deviations by depth.
class NoiseHistogram {
 public:
  explicit NoiseHistogram(const NoiseFitParams& params = {});
  /// Deviation over time of every pixel of a scene that does not move. Pixels with few readings, and pixels
  /// at depth edges (whose readings jump between two surfaces), do not count.
  void add_static(const DepthAverage& average);
  /// Deviation of one image's readings from the plane that fits a middle part of it, in blocks, so that a
  /// smooth bias does not count. Nothing happens when no plane is found.
  void add_plane(const DepthImage& depth);
  /// Deviation of each step of depth that has enough readings, by increasing depth.
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
  double rms_relative = 0;  ///< of the samples' deviation from the fit, relative to it
};

/// sigma(z) = quadratic z^2 + linear z + constant through the samples, by relative error, with quadratic and
/// constant not below 0. An error with fewer than three samples.
Result<NoiseFit> fit_noise(std::span<const NoiseSample> samples);

}  // namespace hm
