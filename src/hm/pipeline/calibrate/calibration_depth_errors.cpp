#include <cmath>
#include <map>

#include "hm/pipeline/calibrate/calibration_depth.hpp"

namespace hm {

std::vector<DistanceError> errors_by_distance(std::span<const DepthViewError> errors) {
  constexpr double kStep_m = 0.25;
  struct Sum {
    double z = 0, before = 0, after = 0, noise = 0;
    std::size_t samples = 0;
  };
  std::map<int, Sum> sums;
  for (const DepthViewError& error : errors) {
    Sum& sum = sums[static_cast<int>(std::lround(error.distance_m / kStep_m))];
    const auto n = static_cast<double>(error.samples);
    sum.z += n * error.distance_m;
    sum.before += n * error.before_rms_m * error.before_rms_m;
    sum.after += n * error.after_rms_m * error.after_rms_m;
    sum.noise += n * error.noise_m * error.noise_m;
    sum.samples += error.samples;
  }
  std::vector<DistanceError> gathered;
  for (const auto& [bin, sum] : sums) {
    const auto n = static_cast<double>(sum.samples);
    gathered.push_back({sum.z / n, sum.samples, std::sqrt(sum.before / n), std::sqrt(sum.after / n),
                        std::sqrt(sum.noise / n)});
  }
  return gathered;
}

}  // namespace hm
