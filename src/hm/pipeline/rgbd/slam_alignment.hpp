#pragma once
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "hm/core/statistics.hpp"
#include "hm/mapping/mapping_params.hpp"
#include "hm/odometry/interface/visual_odometry.hpp"
#include "hm/tsdf/alignment/dense_alignment.hpp"

namespace hm {

/// A frame that was to be aligned.
struct SlamAlignedFrame {
  std::size_t index = 0;
  AlignmentStatus status = AlignmentStatus::kUnusable;
  double shift_m = 0;  ///< between where the frame before puts it, and where it was put
  double drift_m = 0;  ///< between its pose of odometry and its pose; since its submap began
  double rms_before_m = 0, rms_after_m = 0;  ///< distance from what was seen before, of what agrees
};

/// Result of dense alignment of odometry's poses.
struct SlamAlignmentSummary {
  std::size_t accepted = 0, not_accepted = 0;  ///< frames; the first of a submap has nothing to be aligned to
  Summary milliseconds;                        ///< a frame: alignment and its own map
  std::vector<SlamAlignedFrame> frames;        ///< those that were counted
  std::map<AlignmentStatus, std::string> first_reason;  ///< of the first frame not accepted so, in words
};

/// Dense alignment of odometry's poses (dissertation 4.2.8; slam.align): each frame is aligned to what the
/// frames of the last slam.align_memory_frames have seen, in a map of its own in `odom`. So odometry stays
/// odometry: loops, and when they are closed, do not reach into it, and its motions between keyframes go into
/// the pose graph as aligned.
class SlamAlignment {
 public:
  SlamAlignment(const MappingParams& parameters, const PinholeCamera& camera);
  ~SlamAlignment();

  /// Corrects the pose of a tracked frame, and its keyframe's.
  void align(const RgbdFrame& frame, TrackedFrame& tracked);
  [[nodiscard]] SlamAlignmentSummary summary() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
