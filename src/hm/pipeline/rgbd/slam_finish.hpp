#pragma once
#include "hm/core/stopwatch.hpp"
#include "hm/pipeline/rgbd/slam_run.hpp"

namespace hm {

/// A run whose frames have all been tracked.
struct TrackedSlam {
  SlamPipeline& pipeline;
  const Recording& recording;            ///< its frames, by the indices of the pipeline
  const std::filesystem::path& staging;  ///< where the results are written
  const SlamRunOptions& options;
  const Stopwatch& watch;  ///< since the start of the run
};

/// Completes a run after tracking: closes loops, levels and corrects the map, compares with the truth,
/// judges, and writes the results. Completes the summary, whose warnings so far are kept. Errors: no frame
/// has a pose, no memory for the corrected map, writing.
Result<void> finish_slam(const TrackedSlam& run, SlamSummary& summary);

}  // namespace hm
