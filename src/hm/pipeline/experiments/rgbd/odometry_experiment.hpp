#pragma once
#include "hm/pipeline/experiments/common/experiment_findings.hpp"

namespace hm {

/// Fig. 3.12 to 3.15, Table 3.2: visual odometry as published and the default tracker over recordings with
/// true poses (tum_fr1_xyz, tum_fr1_rpy, sevenscenes_a; else a simulated Kinect in the house): paths, sizes
/// of data and model, durations by stage, relative error over a second.
Result<ExperimentFindings> run_odometry_experiment(const ExperimentOptions& options);

}  // namespace hm
