#pragma once
#include <string>

#include "program.hpp"

/// Flags of `hm simulate` for a set of calibration images.
struct CalibrationSetFlags {
  std::string output, sensor;
  int seed = -1;         ///< negative: the parameter's
  bool perfect = false;  ///< no bias, no noise
};

/// `hm simulate calibration`.
hm::Result<Outcome> simulate_calibration_set(const CalibrationSetFlags& flags, Session& session);
