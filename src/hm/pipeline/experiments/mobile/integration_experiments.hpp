#pragma once
#include "hm/pipeline/experiments/common/experiment_findings.hpp"

namespace hm {

/// Fig. 4.19, Table 4.1: a room in which somebody walks about, mapped by traversal and by projection, with
/// and without space carving: pictures, surface error, colour, time of each.
Result<ExperimentFindings> run_integration_experiment(const ExperimentOptions& options);

/// Tables 4.2 and 4.3: time of a scan by method, with and without colour and carving, on walks with a tablet
/// and with a phone through the house, on one thread; and of meshing what changed.
Result<ExperimentFindings> run_scan_time_experiment(const ExperimentOptions& options);

}  // namespace hm
