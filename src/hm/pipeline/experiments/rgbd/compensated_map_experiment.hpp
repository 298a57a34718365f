#pragma once
#include "hm/pipeline/experiments/common/experiment_findings.hpp"

namespace hm {

/// Fig. 3.16: a walk with the simulated phone through the whole house, mapped with and without the depth
/// correction that boards gave.
Result<ExperimentFindings> run_large_map_experiment(const ExperimentOptions& options);

/// Fig. 4.17: the same of one room.
Result<ExperimentFindings> run_phone_room_experiment(const ExperimentOptions& options);

}  // namespace hm
