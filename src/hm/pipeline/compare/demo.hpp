#pragma once
#include <filesystem>

#include "hm/core/run_context.hpp"
#include "hm/pipeline/dense/reconstruction.hpp"
#include "hm/pipeline/simulate/simulation_recording.hpp"

namespace hm {

/// The main job on a generated house.
struct DemoOptions {
  std::filesystem::path output;  ///< gets first_room.png, recording/ and result/
  DenseParameters parameters;
  SimulationParams simulation;
  RunContext run;
};

struct DemoSummary {
  SimulationSummary simulation;
  ReconstructionSummary reconstruction;
};

/// First scans a simulated room in memory and draws it, so that there is something to look at within seconds
/// (first_room.png, which the log names; with reconstruction.pictures only). Then simulates a recording into
/// output/recording (replacing that of an earlier demo, unless output/result holds something else than its
/// result), reconstructs it into output/result, and compares it
/// with the truth: with what the sensor could see within tsdf.far_m, unless simulation.truth_far_m says
/// otherwise. Stopped while it simulates, it leaves neither recording nor picture (kCancelled); stopped
/// later, it finishes with what there is. A second demo into the same folder is refused (kUsage) while one
/// runs.
Result<DemoSummary> run_demo(const DemoOptions& options);

}  // namespace hm
