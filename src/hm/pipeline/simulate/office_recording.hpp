#pragma once
#include <filesystem>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/core/run_context.hpp"
#include "hm/sim/office/office_simulation.hpp"

namespace hm {

/// A drive to simulate, and the folder of its recording.
struct OfficeRecordingOptions {
  OfficeSimulationOptions simulation;
  std::filesystem::path output;  ///< a folder, made if needed; it must not hold a recording
  RunContext run;                ///< stopped early, it leaves nothing
};

/// Result of simulate_office_recording().
struct OfficeRecordingSummary {
  std::size_t scans = 0;
  double duration_s = 0;           ///< from the first scan to the last
  double path_length_m = 0;        ///< of the true path
  double wheel_path_length_m = 0;  ///< as the wheels say
  double valid_ratio = 0;          ///< share of the beams with a reading
  std::vector<std::filesystem::path> outputs;
};

/// Writes a drive through an office floor as open_laser_recording() reads it, with its truth beside it:
///   recording.bag     /scan, /odom: a pose of the wheels at every scan
///   rig.toml          the laser is at the base
///   groundtruth.txt   exact poses T_world_base (TUM)
///   simulation.toml   the values that were simulated with
/// The folder appears whole, as that of simulate_recording(); remove_simulation() removes it.
/// Errors: a folder that holds a recording (kUsage) or cannot be written.
Result<OfficeRecordingSummary> simulate_office_recording(const OfficeRecordingOptions& options);

}  // namespace hm
