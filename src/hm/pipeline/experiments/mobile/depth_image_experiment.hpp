#pragma once
#include "hm/pipeline/experiments/common/experiment_findings.hpp"

namespace hm {

/// Fig. 4.3: depth images of the simulated phone, tablet and Kinect from the same places of the house: what
/// share of the pixels has a reading, and how far readings are off, by distance.
Result<ExperimentFindings> run_depth_image_experiment(const ExperimentOptions& options);

}  // namespace hm
