#pragma once
#include "hm/pipeline/experiments/common/experiment_findings.hpp"

namespace hm {

/// Fig. 2.11: a corridor as the points of all scans, placed by scan matching and loops (recording
/// wean_robotdata1.log, else the simulated flight through the house).
Result<ExperimentFindings> run_corridor_experiment(const ExperimentOptions& options);

/// Fig. 2.12: a plan of a floor of a building (recording flirt_fr079.log with its relations, else the
/// simulated flight).
Result<ExperimentFindings> run_floor_map_experiment(const ExperimentOptions& options);

/// Fig. 2.13, 2.14: a simulated flight through the house: map in three dimensions, and path against the
/// truth.
Result<ExperimentFindings> run_flight_map_experiment(const ExperimentOptions& options);

}  // namespace hm
