#pragma once
#include <memory>

#include "hm/core/statistics.hpp"
#include "hm/odometry/visual_odometry.hpp"
#include "hm/pipeline/parameters.hpp"

namespace hm {

/// What dense alignment made of odometry's poses.
struct SlamAlignmentSummary {
  std::size_t accepted = 0, not_accepted = 0;  ///< frames; the first of a submap has nothing to be aligned to
  Summary milliseconds;                        ///< a frame: alignment and its own map
};

/// Dense alignment of odometry's poses (dissertation 4.2.8; slam.align): each frame is aligned to what the
/// frames of the last slam.align_memory_frames have seen, in a map of its own in `odom`. So odometry stays
/// odometry: loops, and when they are closed, do not reach into it, and its motions between keyframes go into
/// the pose graph as aligned.
class SlamAlignment {
 public:
  SlamAlignment(const Parameters& parameters, const PinholeCamera& camera);
  ~SlamAlignment();

  /// Corrects the pose of a tracked frame, and its keyframe's.
  void align(const RgbdFrame& frame, TrackedFrame& tracked);
  [[nodiscard]] SlamAlignmentSummary summary() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
