#pragma once
#include "hm/pipeline/experiments/common/experiment_findings.hpp"

namespace hm {

/// Fig. 4.9: how weighted running means in integers converge to the mean of noisy samples: rounded down
/// towards zero, rounded, and as implemented (discrete_update_filter.hpp), against the exact mean. A distance
/// in units of 0.1 mm and in those of the map, and a colour that changes.
Result<ExperimentFindings> run_filter_experiment(const ExperimentOptions& options);

}  // namespace hm
