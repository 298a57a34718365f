#pragma once
#include <filesystem>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/core/run_context.hpp"
#include "hm/sim/recording/laser_simulation.hpp"

namespace hm {

/// A flight to simulate, and the folder of its recording.
struct LaserSimulationOptions {
  LaserSimulationParams params;
  std::filesystem::path output;  ///< a folder, made if needed; it must not hold a recording
  RunContext run;                ///< stopped early, it leaves nothing
};

/// Result of simulate_laser_recording().
struct LaserSimulationSummary {
  std::size_t scans = 0, imu_samples = 0, odometry_readings = 0;
  double duration_s = 0;       ///< from the first beam to the last
  double path_length_m = 0;    ///< of the true path
  double valid_ratio = 0;      ///< share of the beams that are not hidden with a reading
  double highest_floor_m = 0;  ///< that was flown over
  double max_tilt_rad = 0;
  double wall_s = 0;
  std::vector<std::filesystem::path> outputs;
};

/// Writes a flight of a laser MAV as open_laser_recording() reads it, with its truth beside it:
///   recording.bag     /scan, /imu, /odom (with wheel_odometry), received later than they were measured
///   rig.toml          where the laser sits and which beams its mirrors turn
///   groundtruth.txt   exact poses T_world_base (TUM)
///   truth_floor.txt   a line a pose: stamp, height of the base over the floor's reference (z = 0), level of
///                     the surface below, level of the surface above (inf: none)
///   truth_mesh.ply    the whole true surface
///   simulation.toml   the parameters in effect
/// The same bytes for any number of threads.
///
/// The folder appears whole, as that of simulate_recording(); remove_simulation() removes it.
/// Errors: parameters out of range, a folder that holds a recording (kUsage) or cannot be written.
Result<LaserSimulationSummary> simulate_laser_recording(const LaserSimulationOptions& options);

}  // namespace hm
