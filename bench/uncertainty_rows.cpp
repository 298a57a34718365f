// Rows about the honesty of depth uncertainty: the experiment of the dissertation's Fig. 3.8
// (`hm evaluate uncertainty`) on a simulated Kinect that stands still.
#include "hm/pipeline/experiments/uncertainty_experiment.hpp"
#include "measurement.hpp"

namespace hm::bench {

Result<BenchResult> bench_covariance(const BenchOptions& options) {
  SimulationParams scene;
  scene.sensor = SensorPreset::kKinect;
  RunContext run;
  run.threads = options.threads;
  const auto experiment = simulate_uncertainty(scene, FeatureParams(), UncertaintyExperimentParams(), run);
  if (!experiment) return forward_error(experiment);
  constexpr std::size_t kQuadratic = 0, kOurs = 1;
  const auto better = [&](PixelSet where) {
    return 100 * (1 - experiment->error_m(kOurs, where) / experiment->error_m(kQuadratic, where));
  };
  const double normalised = experiment->normalised_reading.value();
  BenchResult result;
  result.rows = {{"covariance", normalised, {}},
                 {"covariance_least", normalised, {}},
                 {"covariance_edges", better(PixelSet::kEdges), {}},
                 {"covariance_features", better(PixelSet::kFeatures), {}}};
  const JsonValue json = to_json(*experiment);
  for (const char* key :
       {"views", "frames", "plane_features", "normalised_error_of_mixture_mean", "pixels", "rms_error_mm"})
    result.details[key] = *json.find(key);
  return result;
}

}  // namespace hm::bench
