#pragma once
#include <string>

#include "hm/pipeline/compare/trajectory_evaluation.hpp"

namespace hm {

/// A self-contained page. One trajectory: both paths, errors, motion and pose over time. Several: a table of
/// their errors with and without alignment, all paths in one figure, errors over time.
std::string trajectory_report_html(const TrajectoryComparison& comparison, const std::string& title);

}  // namespace hm
