#pragma once
#include <filesystem>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/core/run_context.hpp"
#include "hm/sim/recording/simulation.hpp"

namespace hm {

/// A walk to simulate, and the folder of its recording.
struct SimulationOptions {
  SimulationParams params;
  std::filesystem::path output;  ///< a folder, made if needed; it must not hold a recording
  RunContext run;                ///< stopped early, it leaves nothing
};

/// Result of simulate_recording().
struct SimulationSummary {
  std::size_t frames = 0;
  double duration_s = 0;     ///< of the recording
  double path_length_m = 0;  ///< of the true path
  double end_drift_m = 0;    ///< how far the last reported position is from the true one
  FlawSizes flaws;
  double valid_ratio = 0;    ///< share of depth pixels with a reading
  double truth_area_m2 = 0;  ///< of the true surface that the frames can see
  std::size_t truth_points = 0;
  double wall_s = 0;
  std::vector<std::filesystem::path> outputs;
};

/// Writes a simulation as a recording in TUM layout, with its truth beside it:
///   depth/ rgb/ depth.txt rgb.txt camera.txt   the recording
///   groundtruth.txt        exact poses; poses.txt the reported ones when they drift or come from wheels
///   flaws.toml             the sizes of its flaws (FlawSizes), if it has some
///   imu.csv imu.toml       what an inertial device at the camera's place felt (simulation.imu)
///   truth_mesh.ply         the whole true surface
///   truth_visible.ply      points (with normals) of the part of it that the frames can see
///   truth_scene.json       the room's analytic solids (room only)
///   simulation.toml        the parameters in effect
/// The same bytes for any number of threads.
///
/// The folder appears whole: until everything is written the parameters lie in simulation.unfinished.toml. A
/// run that fails or is stopped (kCancelled) removes what it wrote; what a killed one left is replaced
/// by the next. The folder is locked (FolderLock) while the run goes on.
/// Errors: parameters out of range, an unknown flaw, a folder that holds a recording (kUsage), that another
/// run writes into (kUsage) or that cannot be written.
Result<SimulationSummary> simulate_recording(const SimulationOptions& options);

}  // namespace hm
