#pragma once
#include <string>

#include "program.hpp"

/// Facts about a finished run.
struct RunFacts {
  std::string verb;  ///< "info", "evaluate mesh"
  double wall_s = 0;
  bool json = false;
};

/// Prints what a verb gave back (text or one JSON object on standard output, errors and warnings on
/// standard error) and returns the exit code.
int print_result(const RunFacts& run, const hm::Result<Outcome>& result);
