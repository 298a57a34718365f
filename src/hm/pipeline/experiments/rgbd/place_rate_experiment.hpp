#pragma once
#include "hm/pipeline/experiments/common/experiment_findings.hpp"

namespace hm {

/// Fig. 3.11, Table 3.1: keyframes of a walk with a Kinect through the house; matrices of the heuristic
/// search, and its candidates and associations against those of brute force for n candidates and k
/// neighbours.
Result<ExperimentFindings> run_place_experiment(const ExperimentOptions& options);

}  // namespace hm
