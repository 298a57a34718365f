#pragma once
#include "hm/pipeline/experiments/common/experiment_findings.hpp"

namespace hm {

/// Fig. 4.21: volumes that a scan of a tablet affects in the house, by voxel size, with and without carving,
/// with dynamic and with fixed truncation, against all volumes in the camera's frustum.
Result<ExperimentFindings> run_affected_volumes_experiment(const ExperimentOptions& options);

/// Fig. 4.22: memory of the hashed grid against that of a fixed grid around it, both with 8 bytes a voxel:
/// 15 m of the corridor at 3 cm, and a desk at 2 cm with readings up to 5 m and up to 2 m (recording
/// tum_fr1_xyz, else the simulated room).
Result<ExperimentFindings> run_map_memory_experiment(const ExperimentOptions& options);

/// Fig. 4.20: a desk from a public recording (tum_fr1_xyz, else the simulated room) at 2 cm, in colour.
Result<ExperimentFindings> run_desk_experiment(const ExperimentOptions& options);

}  // namespace hm
