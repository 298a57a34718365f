#pragma once
#include "hm/core/run_context.hpp"
#include "hm/pipeline/verdict/posed_views.hpp"
#include "hm/pipeline/verdict/run_verdict.hpp"

namespace hm {

/// Adds what images say of a path's steps from one to the next: both show nearly the same, so a pose that is
/// suddenly wrong shows at once, even where no place is seen a second time. Compares the depth images of the
/// sixty steps that are least like the step before and the step after, and the colour images of the first
/// twelve of them.
void judge_steps(const Recording& recording, const std::vector<PosedView>& views, const RunContext& run,
                 RunVerdict& verdict);

}  // namespace hm
