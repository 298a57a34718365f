#pragma once
#include "hm/pipeline/rgbd/slam_run.hpp"

namespace hm {

/// Compares with the truth, writes everything that a run leaves, and completes the summary. `before` is the
/// mesh of odometry's poses; empty: nothing was rebuilt. An error is one of writing.
Result<void> write_slam_results(SlamPipeline& pipeline, const TriangleMesh& before,
                                const SlamRunOptions& options, SlamSummary& summary);

}  // namespace hm
