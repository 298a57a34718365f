// Row about the honesty of depth uncertainty: the experiment of the dissertation's Fig. 3.8 on a simulated
// Kinect that stands still. The deviation of each pixel over many frames is the truth; a model must predict
// it from a single frame.
#include <algorithm>
#include <cmath>
#include <functional>

#include "hm/calibration/depth_average.hpp"
#include "hm/odometry/feature_detection.hpp"
#include "hm/sim/simulation.hpp"
#include "measurement.hpp"

namespace hm::bench {
namespace {

constexpr int kViews = 5;
constexpr int kFrames = 300;
constexpr std::size_t kPredictions = 3;  ///< single frames of a view from which deviations are predicted

/// Deviation of a pixel over time; nothing where less than half of the frames have a reading.
std::optional<double> deviation_m(const DepthAverage& average, int x, int y) {
  if (average.count(x, y) < kFrames / 2) return std::nullopt;
  return average.sigma_m(x, y);
}

/// Sums of squares of something, and how much of it.
struct Squares {
  double sum = 0;
  std::size_t count = 0;
  void add(double value) {
    sum += value * value;
    ++count;
  }
  [[nodiscard]] double rms() const { return count == 0 ? 0 : std::sqrt(sum / static_cast<double>(count)); }
};

/// Errors of predicted deviations, by where they were made.
struct Errors {
  Squares all, edges, planes, features;
};

/// What is predicted: the quadratic model, mixtures with the published alternatives of weights, and ours.
struct Model {
  const char* name;
  std::function<std::optional<DepthGaussian>(const DepthImage&, int x, int y, const DepthNoise&)> predict;
  Errors errors = {};
};

Model mixture(const char* name, const MixtureWeights& weights) {
  return {name, [weights](const DepthImage& depth, int x, int y, const DepthNoise& noise) {
            return mixture_depth(depth, x, y, noise, weights);
          }};
}

/// Features on planes: their depth's error in predicted deviations.
struct Normalised {
  Squares reading, mixture_mean;
};

/// A step of true depth within `radius` pixels that a Kinect's lateral noise can reach across.
bool is_edge(const RenderedView& view, int x, int y, int radius) {
  float low = view.depth_m(x, y), high = low;
  for (int v = std::max(y - radius, 0); v <= std::min(y + radius, view.depth_m.height() - 1); ++v) {
    for (int u = std::max(x - radius, 0); u <= std::min(x + radius, view.depth_m.width() - 1); ++u) {
      low = std::min(low, view.depth_m(u, v));
      high = std::max(high, view.depth_m(u, v));
    }
  }
  return high - low > 0.02F + 0.04F * low;
}

/// Seen within 60 degrees of its normal, far from any edge: where the sensor's axial model holds.
bool is_plane(const RenderedView& view, int x, int y) {
  return view.cos_incidence(x, y) > 0.5F && !is_edge(view, x, y, 4);
}

class Experiment {
 public:
  explicit Experiment(const Simulation& simulation) : simulation_(simulation), renderer_(simulation.world()) {
    models_ = {{"quadratic", quadratic_depth},
               {"corrected_mixture",
                [](const DepthImage& depth, int x, int y, const DepthNoise& noise) {
                  return corrected_mixture_depth(depth, x, y, noise);
                }},
               mixture("mixture_4_2_1", {4, 2, 1}),
               mixture("mixture_10_3_1", {10, 3, 1}),
               mixture("mixture_4_1_0", {4, 1, 0})};
  }

  void stand_still(std::size_t view_number) {
    const std::size_t place = (2 * view_number + 1) * simulation_.frame_count() / (2 * kViews);
    const PinholeCamera& camera = simulation_.camera();
    const RenderedView view = renderer_.render(camera, simulation_.true_pose(place), ParallelLoop(1));
    DepthAverage statistics(camera.width, camera.height);
    std::vector<DepthImage> singles;
    for (int i = 0; i < kFrames; ++i) {
      Rng rng(view_number, static_cast<std::uint64_t>(i));
      DepthImage depth = sense_depth(simulation_.sensor(), simulation_.params().effects, view, rng);
      statistics.add(depth);
      if (i % (kFrames / static_cast<int>(kPredictions)) == 0) singles.push_back(std::move(depth));
    }
    for (const DepthImage& single : singles) compare(view, statistics, single);
  }

  [[nodiscard]] const std::vector<Model>& models() const { return models_; }
  [[nodiscard]] const Normalised& normalised() const { return normalised_; }

 private:
  void compare(const RenderedView& view, const DepthAverage& truth, const DepthImage& single) {
    Image<bool_byte> at_feature(single.width(), single.height(), 0);
    FeatureDetector detector(features_, simulation_.camera(), {100, 100});
    for (const Feature& feature : detector.detect(to_gray(view.color), single)) {
      const int x = static_cast<int>(std::lround(feature.pixel.x()));
      const int y = static_cast<int>(std::lround(feature.pixel.y()));
      if (!feature.has_depth) continue;
      at_feature(x, y) = 1;
      if (is_plane(view, x, y)) normalise(feature, single.depth_m(x, y), view.depth_m(x, y));
    }
    for (int y = 0; y < single.height(); ++y) {
      for (int x = 0; x < single.width(); ++x) {
        const auto deviation = deviation_m(truth, x, y);
        if (!deviation || single.units(x, y) == 0) continue;
        const bool edge = is_edge(view, x, y, 1), plane = is_plane(view, x, y);
        for (Model& model : models_) {
          const double error =
              std::sqrt(model.predict(single, x, y, features_.depth_noise)->variance_m2) - *deviation;
          model.errors.all.add(error);
          if (edge) model.errors.edges.add(error);
          if (plane) model.errors.planes.add(error);
          if (at_feature(x, y) != 0) model.errors.features.add(error);
        }
      }
    }
  }

  void normalise(const Feature& feature, double reading_m, float truth_m) {
    const double sigma = std::sqrt(feature.covariance(2, 2));
    normalised_.reading.add((reading_m - static_cast<double>(truth_m)) / sigma);
    normalised_.mixture_mean.add((feature.p_camera.z() - static_cast<double>(truth_m)) / sigma);
  }

  using bool_byte = std::uint8_t;
  const Simulation& simulation_;
  Renderer renderer_;
  FeatureParams features_;
  std::vector<Model> models_;
  Normalised normalised_;
};

JsonValue to_json(const Model& model) {
  return JsonValue::object({{"model", model.name},
                            {"all_mm", model.errors.all.rms() * 1e3},
                            {"edges_mm", model.errors.edges.rms() * 1e3},
                            {"planes_mm", model.errors.planes.rms() * 1e3},
                            {"features_mm", model.errors.features.rms() * 1e3}});
}

}  // namespace

Result<BenchResult> bench_covariance(const BenchOptions&) {
  SimulationParams scene;
  scene.sensor = SensorPreset::kKinect;
  const Simulation simulation(scene);
  Experiment experiment(simulation);
  for (std::size_t view = 0; view < kViews; ++view) experiment.stand_still(view);
  const auto& models = experiment.models();
  const auto better = [&](Squares Errors::*where) {
    return 100 * (1 - (models[1].errors.*where).rms() / (models[0].errors.*where).rms());
  };
  BenchResult result;
  const double normalised = experiment.normalised().reading.rms();
  result.rows = {{"covariance", normalised, {}},
                 {"covariance_least", normalised, {}},
                 {"covariance_edges", better(&Errors::edges), {}},
                 {"covariance_features", better(&Errors::features), {}}};
  result.details =
      JsonValue::object({{"views", kViews},
                         {"frames", kFrames},
                         {"plane_features", experiment.normalised().reading.count},
                         {"edge_pixels", models[0].errors.edges.count},
                         {"normalised_error_of_mixture_mean", experiment.normalised().mixture_mean.rms()}});
  JsonValue rms = JsonValue::array();
  for (const Model& model : models) rms.push_back(to_json(model));
  result.details["rms_error_of_deviation"] = std::move(rms);
  return result;
}

}  // namespace hm::bench
