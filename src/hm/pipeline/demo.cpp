#include "hm/pipeline/demo.hpp"

namespace hm {

Result<DemoSummary> run_demo(const DemoOptions& options) {
  SimulationOptions simulation;
  simulation.params = options.parameters.simulation;
  if (simulation.params.truth_far_m == 0) simulation.params.truth_far_m = options.parameters.tsdf.far_m;
  simulation.output = options.output / "recording";
  simulation.threads = options.threads;
  simulation.progress = options.progress;
  simulation.stop = options.stop;
  remove_simulation(simulation.output);  // what an earlier demo left
  auto simulated = simulate_recording(simulation);
  std::error_code ignored;
  if (!simulated) std::filesystem::remove(options.output, ignored);  // if nothing is in it
  if (!simulated) return forward_error(simulated);
  if (options.stop.stop_requested())
    return fail(ErrorCode::kCancelled, {}, "stopped after the simulation; its recording is in {}",
                simulation.output.string());

  ReconstructionOptions reconstruction;
  reconstruction.recording = simulation.output;
  reconstruction.output = options.output / "result";
  reconstruction.parameters = options.parameters;
  reconstruction.threads = options.threads;
  reconstruction.program_version = options.program_version;
  reconstruction.progress = options.progress;
  reconstruction.log = options.log;
  reconstruction.stop = options.stop;
  auto summary = reconstruct(reconstruction);
  if (!summary) return forward_error(summary);
  return DemoSummary{std::move(*simulated), std::move(*summary)};
}

}  // namespace hm
