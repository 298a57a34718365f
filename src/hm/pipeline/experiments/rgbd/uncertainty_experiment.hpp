#pragma once
#include <array>
#include <cmath>
#include <filesystem>
#include <vector>

#include "hm/core/json_value.hpp"
#include "hm/core/run_context.hpp"
#include "hm/io/rgbd/recording.hpp"
#include "hm/odometry/feature/feature_params.hpp"
#include "hm/report/html_report.hpp"
#include "hm/sim/recording/simulation.hpp"

namespace hm {

/// Views and frames of a still scene.
struct UncertaintyExperimentParams {
  int views = 5;        ///< of the simulation
  int frames = 300;     ///< of each view; of a recording at most
  int predictions = 3;  ///< single frames of a view from which deviations are predicted
};

/// Models of deviation: the quadratic model, the mixture with noise counted once (what odometry uses), and
/// the published mixture with three choices of weights (centre, edge, corner of the 3x3 window).
inline constexpr std::array kUncertaintyModels{"quadratic", "corrected_mixture", "mixture_4_2_1",
                                               "mixture_10_3_1", "mixture_4_1_0"};
inline constexpr std::size_t kUncertaintyModelCount = kUncertaintyModels.size();

/// Root mean square of something, and how much of it there was.
struct RootMeanSquare {
  double sum = 0;
  std::size_t count = 0;
  void add(double value) {
    sum += value * value;
    ++count;
  }
  [[nodiscard]] double value() const { return count == 0 ? 0 : std::sqrt(sum / static_cast<double>(count)); }
};

/// Pixels on which predictions are evaluated. Features: pixels that odometry's detector chooses, with a
/// reading. Edges: a step of depth to one of the 8 neighbours. Planes (simulation only): seen within 60
/// degrees of their normal, 4 pixels from any edge.
enum class PixelSet { kAll, kFeatures, kEdges, kPlanes };
inline constexpr std::array kPixelSetNames{"all", "features", "edges", "planes"};
inline constexpr std::size_t kPixelSetCount = kPixelSetNames.size();

/// Errors of a model's predicted deviations.
struct ModelErrors {
  std::array<RootMeanSquare, kPixelSetCount> error_m;  ///< predicted minus actual
  /// Errors and predicted deviations by actual depth, in steps of kUncertaintyDepthStep_m from 0.
  std::array<std::vector<RootMeanSquare>, kPixelSetCount> error_by_depth_m, predicted_by_depth_m;
};
inline constexpr double kUncertaintyDepthStep_m = 0.25;

/// Deviations of one view as images, metres; NaN where there is none.
struct DeviationImages {
  Image<Rgb8> color;
  Image<float> actual_m;
  std::array<Image<float>, kUncertaintyModelCount> predicted_m;  ///< from one frame
};

struct UncertaintyResult {
  std::string scene;
  std::size_t views = 0, frames = 0, unreadable = 0;
  std::array<ModelErrors, kUncertaintyModelCount> models;
  std::array<std::vector<RootMeanSquare>, kPixelSetCount> actual_by_depth_m;
  /// Features on planes (simulation only): errors of the reading and of the mixture's mean in deviations
  /// that the corrected mixture predicts.
  RootMeanSquare normalised_reading, normalised_mean;
  DeviationImages images;  ///< of the view in the middle
  std::vector<std::string> warnings;
  [[nodiscard]] double error_m(std::size_t model, PixelSet set) const {
    return models[model].error_m[static_cast<std::size_t>(set)].value();
  }
};

/// The experiment of the dissertation's Fig. 3.8: the deviation of each pixel's depth over many frames of a
/// still scene is the truth; each model predicts it from single frames. Here with a simulated sensor that
/// stands still at some places of its walk.
Result<UncertaintyResult> simulate_uncertainty(const SimulationParams& scene, const FeatureParams& features,
                                               const UncertaintyExperimentParams& params,
                                               const RunContext& run);

/// Measures predicted against actual deviations in a recording in which nothing moves: its first frames,
/// from frame 0. A pixel counts when half
/// of them have a reading. Errors: recording unusable, fewer than 10 frames.
Result<UncertaintyResult> record_uncertainty(const std::filesystem::path& recording,
                                             const RecordingOptions& how, const FeatureParams& features,
                                             const UncertaintyExperimentParams& params,
                                             const RunContext& run);

/// Writes report.json, report.html with plots over depth, and pictures/ of the deviations.
Result<std::vector<std::filesystem::path>> write_uncertainty(const UncertaintyResult& result,
                                                             const std::filesystem::path& output,
                                                             const RunContext& run);
/// Adds a page's plots over depth and the deviations of a view.
void add_uncertainty_figures(HtmlReport& report, const UncertaintyResult& result);
/// rms_error_mm by model and set of pixels, better_than_quadratic_percent ...
JsonValue to_json(const UncertaintyResult& result);
std::string to_text(const UncertaintyResult& result);

struct ExperimentOptions;
struct ExperimentFindings;
/// simulate_uncertainty() of a Kinect as an entry of experiments().
Result<ExperimentFindings> run_uncertainty_experiment(const ExperimentOptions& options);

}  // namespace hm
