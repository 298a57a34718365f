#pragma once
#include "hm/pipeline/dense/reconstruction.hpp"
#include "hm/pipeline/dense/reconstruction_state.hpp"
#include "hm/report/html_report.hpp"

namespace hm {

/// Poses from a file that took the place of the recording's; none: the recording's own were aligned.
struct GivenPoses {
  const Trajectory& poses;
  Duration max_gap;  ///< between two poses that others are interpolated from
};

/// Counts and the errors of the given and of the aligned poses where the true ones are known; the times and
/// statuses of this run are the caller's.
AlignmentSummary summarise_alignment(const ReconstructionState& state, const GivenPoses& given,
                                     const RecordingInfo& info, const DenseParameters& parameters);

/// Warns when most frames could not be aligned; empty otherwise.
std::string alignment_warning(const AlignmentSummary& alignment);

/// accepted, not_accepted, align_ms{}, ate_given_m, ate_aligned_m.
void visit(const AlignmentSummary& alignment, SummaryTree& v);

/// The section of the report: both paths (and the true one), the distance from the map before and after, the
/// corrections.
void add_alignment_section(HtmlReport& report, const ReconstructionSummary& summary);

}  // namespace hm
