#pragma once
#include <memory>
#include <optional>

#include "hm/core/run_context.hpp"
#include "hm/io/laser/laser_recording.hpp"
#include "hm/io/rgbd/recording.hpp"
#include "hm/pipeline/serve/replay.hpp"

namespace hm {

struct DenseParameters;
struct LaserRunParameters;
struct RgbdParameters;

/// A recording with poses: its frames integrated one by one, as `hm reconstruct` does. All must outlive it;
/// `run.view` is shown everything.
std::unique_ptr<ReplaySubject> replay_of_poses(const Recording& recording, const DenseParameters& parameters,
                                               const RunContext& run);
/// A recording without poses: its frames tracked and mapped one by one, as `hm slam` does.
std::unique_ptr<ReplaySubject> replay_of_tracking(const Recording& recording,
                                                  const RgbdParameters& parameters, const RunContext& run);
/// A laser recording: its scans as `hm laser` does them.
std::unique_ptr<ReplaySubject> replay_of_laser(const LaserRecording& recording,
                                               const LaserRunParameters& parameters, const RunContext& run);

}  // namespace hm
