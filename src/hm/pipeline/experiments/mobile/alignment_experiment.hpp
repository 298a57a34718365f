#pragma once
#include "hm/pipeline/experiments/common/experiment_findings.hpp"

namespace hm {

/// Fig. 4.11, 4.12: a walk with a tablet through the house whose poses drift as those of visual-inertial
/// odometry do, mapped with the poses as given and with dense alignment (4.2.8): paths and maps of both
/// against the truth.
Result<ExperimentFindings> run_alignment_experiment(const ExperimentOptions& options);

}  // namespace hm
