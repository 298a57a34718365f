#pragma once
#include "hm/pipeline/experiments/common/experiment_findings.hpp"

namespace hm {

/// Fig. 2.18 to 2.20, Table 2.1: multi-volume occupancy grids of the New College scans (else simulated
/// vertical lasers in the house): stages of the map, plans at several heights, and its size against the
/// published structure, dense arrays and an octree file at three resolutions.
Result<ExperimentFindings> run_grid_experiment(const ExperimentOptions& options);

/// Fig. 2.21: the same in a simulated corridor, where volumes are long: size and time over the scans.
Result<ExperimentFindings> run_hallway_grid_experiment(const ExperimentOptions& options);

}  // namespace hm
