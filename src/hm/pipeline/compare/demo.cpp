#include "hm/pipeline/compare/demo.hpp"

namespace hm {
Result<DemoSummary> run_demo(const DemoOptions& options) {
  SimulationOptions simulation{options.parameters.simulation, options.output / "recording", options.run};
  if (simulation.params.truth_far_m == 0) simulation.params.truth_far_m = options.parameters.tsdf.far_m;
  remove_simulation(simulation.output);  // what an earlier demo left
  auto simulated = simulate_recording(simulation);
  std::error_code ignored;
  if (!simulated) std::filesystem::remove(options.output, ignored);  // if nothing is in it
  if (!simulated) return forward_error(simulated);
  if (options.run.stop.stop_requested())
    return fail(ErrorCode::kCancelled, {}, "stopped after the simulation; its recording is in {}",
                simulation.output.string());

  ReconstructionOptions reconstruction;
  reconstruction.recording = simulation.output;
  reconstruction.output = options.output / "result";
  const auto record = read_run_record(reconstruction.output);  // of an earlier demo
  if (record && *record && (*record)->is_of({{}, {}, "reconstruct", simulation.output, {}}))
    reconstruction.existing = ExistingResult::kOverwrite;
  reconstruction.parameters = options.parameters;
  reconstruction.run = options.run;
  auto summary = reconstruct(reconstruction);
  if (!summary) return forward_error(summary);
  return DemoSummary{std::move(*simulated), std::move(*summary)};
}

}  // namespace hm
