#pragma once
#include "hm/pipeline/experiments/common/experiment_findings.hpp"

namespace hm {

/// Fig. 2.5: a vehicle flies forward and backward over flat objects of varying heights, at heights of its
/// own. Height and level of the floor by the mirror's beams, against the truth.
Result<ExperimentFindings> run_height_experiment(const ExperimentOptions& options);

/// Fig. 2.8: hovers for four minutes in the house, under the published controllers (2.18) with an attitude
/// loop as on the vehicle of the dissertation, and under the default cascade. Distance from the goal on each
/// axis, by the estimate (as published) and by the truth, from three seconds after it began to wait.
Result<ExperimentFindings> run_hover_experiment(const ExperimentOptions& options);

/// Fig. 2.9: way points in the room that vary in x, y and yaw, under both control laws.
Result<ExperimentFindings> run_way_point_experiment(const ExperimentOptions& options);

}  // namespace hm
