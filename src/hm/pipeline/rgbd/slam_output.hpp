#pragma once
#include "hm/pipeline/rgbd/slam_run.hpp"

namespace hm {

/// Surface that odometry's poses give; empty: nothing was rebuilt.
struct OdometryMesh {
  TriangleMesh mesh;
  bool of_keyframes_alone = false;
};

/// Compares with the truth, writes everything that a run leaves, and completes the summary. An error is one
/// of writing.
Result<void> write_slam_results(SlamPipeline& pipeline, const OdometryMesh& before,
                                const SlamRunOptions& options, SlamSummary& summary);

}  // namespace hm
