#pragma once
#include "hm/pipeline/calibrate/calibration_depth.hpp"
#include "hm/pipeline/calibrate/calibration_simulation.hpp"
#include "hm/pipeline/experiments/common/experiment_findings.hpp"

namespace hm {

/// A simulated set of boards, and the correction that was fitted to it.
struct CalibratedBoards {
  CalibrationRig rig;
  std::filesystem::path set;  ///< of the depth images
  DepthCalibrationSummary summary;
};
/// Simulates boards before a sensor (output/boards) and calibrates its depth (output/calibration).
Result<CalibratedBoards> calibrate_boards(CalibrationSensor sensor, const ExperimentOptions& options);

/// Fig. 3.2 to 3.7: boards before a simulated Xtion whose depth is biased: a training pair, all training
/// images, the correction over the image, a wall seen from above before and after, error by distance.
Result<ExperimentFindings> run_depth_bias_experiment(const ExperimentOptions& options);

/// Fig. 4.4, 4.5: the same for the simulated phone, whose bias is up to 30 cm at 3 m.
Result<ExperimentFindings> run_phone_bias_experiment(const ExperimentOptions& options);

}  // namespace hm
