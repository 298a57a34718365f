#pragma once
#include <filesystem>

#include "hm/core/progress.hpp"
#include "hm/core/result.hpp"
#include "hm/sim/simulation.hpp"

namespace hm {

/// What simulate_recording() made.
struct SimulationSummary {
  std::size_t frames = 0;
  double duration_s = 0;     ///< of the recording
  double path_length_m = 0;  ///< of the true path
  double end_drift_m = 0;    ///< how far the last reported position is from the true one
  double valid_ratio = 0;    ///< share of depth pixels with a reading
  double truth_area_m2 = 0;  ///< of the true surface that the frames can see
  std::size_t truth_points = 0;
  double wall_s = 0;
  std::vector<std::filesystem::path> outputs;
};

/// Writes a simulation as a recording in TUM layout, with its truth beside it:
///   depth/ rgb/ depth.txt rgb.txt camera.txt   the recording
///   groundtruth.txt        exact poses; poses.txt the reported ones when they drift
///   truth_mesh.ply         the whole true surface
///   truth_visible.ply      points (with normals) of the part of it that the frames can see
///   truth_scene.json       the room's analytic solids (room only)
///   simulation.toml        the parameters in effect
/// The folder is made if needed. The same bytes for any number of threads.
Result<SimulationSummary> simulate_recording(const SimulationParams& params,
                                             const std::filesystem::path& folder,
                                             const ProgressSink& progress, int threads);

}  // namespace hm
