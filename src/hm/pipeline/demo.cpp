#include "hm/pipeline/demo.hpp"

namespace hm {

Result<DemoSummary> run_demo(const DemoOptions& options) {
  const auto recording = options.output / "recording";
  std::error_code code;
  if (std::filesystem::exists(recording / "simulation.toml", code))
    std::filesystem::remove_all(recording, code);  // what an earlier demo left
  auto simulation =
      simulate_recording(options.parameters.simulation, recording, options.progress, options.threads);
  if (!simulation) return forward_error(simulation);
  if (options.stop.stop_requested()) return fail(ErrorCode::kCancelled, {}, "stopped after the simulation");

  ReconstructionOptions reconstruction;
  reconstruction.recording = recording;
  reconstruction.output = options.output / "result";
  reconstruction.parameters = options.parameters;
  reconstruction.threads = options.threads;
  reconstruction.program_version = options.program_version;
  reconstruction.progress = options.progress;
  reconstruction.log = options.log;
  reconstruction.stop = options.stop;
  auto summary = reconstruct(reconstruction);
  if (!summary) return forward_error(summary);
  return DemoSummary{std::move(*simulation), std::move(*summary)};
}

}  // namespace hm
