#pragma once
#include <string>

#include "program.hpp"

/// Flags of `hm simulate` for a set of calibration images.
struct CalibrationSetFlags {
  std::string output, sensor;
  int seed = -1;         ///< negative: the parameter's
  bool perfect = false;  ///< no bias, no noise
};

/// `hm simulate calibration`; null where the calibration's part was not built.
using SimulateCalibrationSet = hm::Result<Outcome> (*)(const CalibrationSetFlags& flags, Session& session);
inline SimulateCalibrationSet simulate_calibration_set = nullptr;
