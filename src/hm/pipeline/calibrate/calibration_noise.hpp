#pragma once
#include "hm/calibration/noise_fit.hpp"
#include "hm/io/rgbd/recording.hpp"
#include "hm/pipeline/calibrate/calibration_set.hpp"

namespace hm {

/// Source of the deviations.
enum class NoiseSource { kStatic, kPlanes };

struct NoiseCalibrationOptions {
  std::filesystem::path input;  ///< a recording, or a folder of poses as `hm calibrate depth` takes it
  RecordingOptions recording_options;
  NoiseSource source =
      NoiseSource::kStatic;         ///< static: neither camera nor scene moves within a pose or recording
  double depth_units_per_m = 1000;  ///< of a folder of poses
  std::optional<DisparityModel> disparity;  ///< a folder of poses holds raw disparity
  int frame_limit = 300;                    ///< frames of a recording that are used at most
  std::filesystem::path output;             ///< a folder
  NoiseFitParams fit;
  RunContext run;  ///< stopped early, nothing is written
};

struct NoiseCalibrationSummary {
  std::size_t images = 0, unreadable = 0;
  std::string first_unreadable;
  std::vector<NoiseSample> samples;
  NoiseFit fit;
  std::vector<std::string> warnings;
  std::vector<std::filesystem::path> outputs;
};

/// Axial noise against depth (dissertation 3.1.3): writes noise.toml, which `hm reconstruct --params` takes,
/// report.json and report.html. Errors: input unusable, deviations at too few distances.
Result<NoiseCalibrationSummary> calibrate_noise(const NoiseCalibrationOptions& options);
void visit(const NoiseCalibrationSummary& summary, SummaryTree& v);
std::string to_text(const NoiseCalibrationSummary& summary);

}  // namespace hm
