#include "hm/pipeline/experiments/rgbd/uncertainty_experiment.hpp"

#include <algorithm>
#include <limits>

#include "hm/calibration/depth_average.hpp"
#include "hm/core/statistics.hpp"
#include "hm/core/text/counted.hpp"
#include "hm/odometry/feature/feature_detection.hpp"
#include "hm/pipeline/common/reading_warnings.hpp"
#include "hm/sim/sensor/renderer.hpp"

namespace hm {
namespace {

constexpr std::array<MixtureWeights, 3> kWeights{{{4, 2, 1}, {10, 3, 1}, {4, 1, 0}}};

std::optional<DepthGaussian> predict(std::size_t model, const DepthImage& depth, int x, int y,
                                     const DepthNoise& noise) {
  if (model == 0) return quadratic_depth(depth, x, y, noise);
  if (model == 1) return corrected_mixture_depth(depth, x, y, noise);
  return mixture_depth(depth, x, y, noise, kWeights[model - 2]);
}

/// A step of depth within `radius` pixels, of more than lateral noise makes of a slope; 0 is no depth.
bool is_edge(const Image<float>& depth_m, int x, int y, int radius) {
  float low = depth_m(x, y), high = low;
  for (int v = std::max(y - radius, 0); v <= std::min(y + radius, depth_m.height() - 1); ++v) {
    for (int u = std::max(x - radius, 0); u <= std::min(x + radius, depth_m.width() - 1); ++u) {
      if (depth_m(u, v) <= 0) continue;
      low = std::min(low, depth_m(u, v));
      high = std::max(high, depth_m(u, v));
    }
  }
  return high - low > 0.02F + 0.04F * low;
}

/// A place from which a still scene was seen.
struct StillView {
  PinholeCamera camera;
  DepthAverage readings;
  std::vector<RgbdFrame> singles;  ///< from which deviations are predicted
  Image<float> depth_m;            ///< the true depth, or the mean of the readings
  Image<float> cos_incidence;      ///< empty for a recording
};

/// Gathers the comparison over views.
class Comparison {
 public:
  /// Images are kept of the view with this number.
  Comparison(const FeatureParams& features, std::size_t image_view, UncertaintyResult& result)
      : features_(features), image_view_(image_view), result_(result) {}
  void add(const StillView& view);

 private:
  using PixelSets = std::array<bool, kPixelSetCount>;
  [[nodiscard]] Image<std::uint8_t> feature_pixels(const StillView& view, const RgbdFrame& single);
  void compare_pixel(const RgbdFrame& single, int x, int y, double actual_m, const PixelSets& sets);
  void normalise(const Feature& feature, double reading_m, double truth_m);
  void keep_images(const StillView& view);

  const FeatureParams& features_;
  std::size_t image_view_;
  UncertaintyResult& result_;
};

/// Seen within 60 degrees of its normal, far from any edge: where the sensor's axial model holds.
bool is_plane(const StillView& view, int x, int y) {
  return !view.cos_incidence.empty() && view.cos_incidence(x, y) > 0.5F && !is_edge(view.depth_m, x, y, 4);
}

std::optional<double> actual_deviation_m(const StillView& view, int x, int y) {
  if (view.readings.count(x, y) < std::max(2, view.readings.images() / 2)) return std::nullopt;
  return view.readings.sigma_m(x, y);
}

void Comparison::normalise(const Feature& feature, double reading_m, double truth_m) {
  const double sigma_m = std::sqrt(feature.covariance(2, 2));
  result_.normalised_reading.add((reading_m - truth_m) / sigma_m);
  result_.normalised_mean.add((feature.p_camera.z() - truth_m) / sigma_m);
}

Image<std::uint8_t> Comparison::feature_pixels(const StillView& view, const RgbdFrame& single) {
  Image<std::uint8_t> at_feature(single.depth.width(), single.depth.height(), 0);
  if (single.color.width() != single.depth.width() || single.color.height() != single.depth.height())
    return at_feature;
  FeatureDetector detector(features_, view.camera, {100, 100});
  for (const Feature& feature : detector.detect(to_gray(single.color), single.depth)) {
    if (!feature.has_depth) continue;
    const int x = static_cast<int>(std::lround(feature.pixel.x()));
    const int y = static_cast<int>(std::lround(feature.pixel.y()));
    at_feature(x, y) = 1;
    if (is_plane(view, x, y))
      normalise(feature, single.depth.depth_m(x, y), static_cast<double>(view.depth_m(x, y)));
  }
  return at_feature;
}

void add_at(std::vector<RootMeanSquare>& by_depth, double depth_m, double value) {
  const auto bin = static_cast<std::size_t>(depth_m / kUncertaintyDepthStep_m);
  if (by_depth.size() <= bin) by_depth.resize(bin + 1);
  by_depth[bin].add(value);
}

void Comparison::compare_pixel(const RgbdFrame& single, int x, int y, double actual_m,
                               const PixelSets& sets) {
  const double depth_m = single.depth.depth_m(x, y);
  for (std::size_t set = 0; set < kPixelSetCount; ++set)
    if (sets[set]) add_at(result_.actual_by_depth_m[set], depth_m, actual_m);
  for (std::size_t m = 0; m < kUncertaintyModelCount; ++m) {
    ModelErrors& errors = result_.models[m];
    const double predicted_m = std::sqrt(predict(m, single.depth, x, y, features_.depth_noise)->variance_m2);
    for (std::size_t set = 0; set < kPixelSetCount; ++set) {
      if (!sets[set]) continue;
      errors.error_m[set].add(predicted_m - actual_m);
      add_at(errors.error_by_depth_m[set], depth_m, predicted_m - actual_m);
      add_at(errors.predicted_by_depth_m[set], depth_m, predicted_m);
    }
  }
}

void Comparison::keep_images(const StillView& view) {
  const RgbdFrame& single = view.singles.front();
  DeviationImages& images = result_.images;
  const float none = std::numeric_limits<float>::quiet_NaN();
  const int width = single.depth.width(), height = single.depth.height();
  images.color = single.color;
  images.actual_m = Image<float>(width, height, none);
  images.predicted_m.fill(images.actual_m);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      if (const auto actual = actual_deviation_m(view, x, y))
        images.actual_m(x, y) = static_cast<float>(*actual);
      for (std::size_t m = 0; m < kUncertaintyModelCount; ++m)
        if (const auto predicted = predict(m, single.depth, x, y, features_.depth_noise))
          images.predicted_m[m](x, y) = static_cast<float>(std::sqrt(predicted->variance_m2));
    }
}

void Comparison::add(const StillView& view) {
  if (result_.views++ == image_view_) keep_images(view);
  result_.frames += static_cast<std::size_t>(view.readings.images());
  for (const RgbdFrame& single : view.singles) {
    const Image<std::uint8_t> at_feature = feature_pixels(view, single);
    for (int y = 0; y < single.depth.height(); ++y)
      for (int x = 0; x < single.depth.width(); ++x) {
        const auto actual_m = actual_deviation_m(view, x, y);
        if (!actual_m || single.depth.units(x, y) == 0) continue;
        const bool edge = view.depth_m(x, y) > 0 && is_edge(view.depth_m, x, y, 1);
        compare_pixel(single, x, y, *actual_m, {true, at_feature(x, y) != 0, edge, is_plane(view, x, y)});
      }
  }
}

bool is_single(int frame, int frames, const UncertaintyExperimentParams& params) {
  return frame % std::max(1, frames / params.predictions) == 0;
}

Result<void> step(const RunContext& run, int done, int total) {
  if (run.progress)
    run.progress({"reading depth", static_cast<std::size_t>(done), static_cast<std::size_t>(total), {}});
  if (run.stop.stop_requested()) return fail(ErrorCode::kCancelled, "", "stopped while reading depth");
  return {};
}

Image<float> mean_depth_m(const DepthAverage& readings) {
  Image<float> mean(readings.width(), readings.height());
  for (int y = 0; y < mean.height(); ++y)
    for (int x = 0; x < mean.width(); ++x) mean(x, y) = static_cast<float>(readings.mean_m(x, y));
  return mean;
}

/// A scene in motion has pixels whose readings fall into few clusters; seen here as a median deviation many
/// times what the sensor's noise is.
void warn_of_motion(const FeatureParams& features, UncertaintyResult& result) {
  std::vector<double> ratios;
  const auto& actual = result.images.actual_m;
  const auto& quadratic = result.images.predicted_m[0];
  for (int y = 0; y < actual.height(); y += 3)
    for (int x = 0; x < actual.width(); x += 3)
      if (std::isfinite(actual(x, y)) && std::isfinite(quadratic(x, y)))
        ratios.push_back(static_cast<double>(actual(x, y) / quadratic(x, y)));
  const double middle = quantile(std::move(ratios), 0.5);
  if (middle > 2)
    result.warnings.push_back(fmt::format(
        "half of the pixels deviate by more than {:.1f} times what section odometry_features says "
        "({:.1f} mm at 2 m): "
        "did camera or scene move?",
        middle, 1e3 * features.depth_noise.sigma_m(2)));
}

}  // namespace

Result<UncertaintyResult> simulate_uncertainty(const SimulationParams& scene, const FeatureParams& features,
                                               const UncertaintyExperimentParams& params,
                                               const RunContext& run) {
  const Simulation simulation(scene);
  const Renderer renderer(simulation.world());
  UncertaintyResult result;
  result.scene = fmt::format("simulated {} in the {}", kSensorPresetNames[static_cast<int>(scene.sensor)],
                             kWorldKindNames[static_cast<int>(scene.world)]);
  Comparison comparison(features, static_cast<std::size_t>(params.views / 2), result);
  for (int number = 0; number < params.views; ++number) {
    const std::size_t place = static_cast<std::size_t>(2 * number + 1) * simulation.frame_count() /
                              (2 * static_cast<std::size_t>(params.views));
    const PinholeCamera& camera = simulation.camera();
    RenderedView truth = renderer.render(camera, simulation.true_pose(place), ParallelLoop(run.threads));
    StillView view{camera, DepthAverage(camera.width, camera.height), {}, {}, {}};
    for (int i = 0; i < params.frames; ++i) {
      if (auto go_on = step(run, number * params.frames + i, params.views * params.frames); !go_on)
        return forward_error(go_on);
      Rng rng(static_cast<std::uint64_t>(number), static_cast<std::uint64_t>(i));
      RgbdFrame frame;
      frame.depth = sense_depth(simulation.sensor(), scene.effects, truth, rng);
      view.readings.add(frame.depth);
      if (!is_single(i, params.frames, params)) continue;
      frame.color = truth.color;
      view.singles.push_back(std::move(frame));
    }
    view.depth_m = std::move(truth.depth_m);
    view.cos_incidence = std::move(truth.cos_incidence);
    comparison.add(view);
  }
  return result;
}

Result<UncertaintyResult> record_uncertainty(const std::filesystem::path& path, const RecordingOptions& how,
                                             const FeatureParams& features,
                                             const UncertaintyExperimentParams& params,
                                             const RunContext& run) {
  constexpr int kLeastFrames = 10;
  const auto recording = open_recording(path, how);
  if (!recording) return forward_error(recording);
  const PinholeCamera camera = (*recording)->info().camera.without_distortion();
  const int count = std::min(params.frames, static_cast<int>((*recording)->info().frame_count));
  UncertaintyResult result;
  result.scene = path.filename().string();
  StillView view{camera, DepthAverage(camera.width, camera.height), {}, {}, {}};
  FramePrefetcher frames(**recording, 0, static_cast<std::size_t>(count), 1, {.readers = run.threads});
  for (int done = 0; auto frame = frames.next(); ++done) {
    if (auto go_on = step(run, done, count); !go_on) return forward_error(go_on);
    if (!*frame) {
      ++result.unreadable;
      continue;
    }
    view.readings.add((*frame)->depth);
    if (is_single(done, count, params)) view.singles.push_back(std::move(**frame));
  }
  if (view.readings.images() < kLeastFrames || view.singles.empty())
    return fail(ErrorCode::kInvalidValue, path, "{} can be read; standard deviations need at least {}",
                counted(view.readings.images(), "frame"), kLeastFrames);
  result.warnings = reading_warnings((*recording)->info());
  if (result.unreadable > 0)
    result.warnings.push_back(
        fmt::format("{} left out: they cannot be read", counted(result.unreadable, "frame")));
  view.depth_m = mean_depth_m(view.readings);
  Comparison(features, 0, result).add(view);
  warn_of_motion(features, result);
  return result;
}

}  // namespace hm
