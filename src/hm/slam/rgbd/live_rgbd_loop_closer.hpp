#pragma once
#include <cstddef>
#include <memory>

#include "hm/slam/rgbd/rgbd_loop_closer.hpp"

namespace hm {

/// Runs an RgbdLoopCloser on a separate thread, so that tracking never waits. The keyframes included in a
/// snapshot depend on the machine's speed; the result after finish() equals that of RgbdLoopCloser. An
/// exception of the thread (std::bad_alloc) is thrown by add() and finish() from then on.
class LiveRgbdLoopCloser {
 public:
  explicit LiveRgbdLoopCloser(const PinholeCamera& camera, const RgbdLoopParams& params = {},
                              ThreadPriority priority = ThreadPriority::kNormal);
  /// Waits for the current keyframe; those in the queue are dropped.
  ~LiveRgbdLoopCloser();
  LiveRgbdLoopCloser(const LiveRgbdLoopCloser&) = delete;
  LiveRgbdLoopCloser& operator=(const LiveRgbdLoopCloser&) = delete;

  /// Latest result.
  struct Snapshot {
    std::shared_ptr<const CorrectedKeyframes> corrected;  ///< never null
    std::size_t solutions = 0;                            ///< increases when poses have changed
    RgbdLoopStatistics statistics;
    std::size_t waiting_keyframes = 0;  ///< not yet processed
  };

  /// Queues a keyframe and returns at once. May be called from one thread; snapshot() from any.
  void add(std::shared_ptr<const Keyframe> keyframe);
  [[nodiscard]] Snapshot snapshot() const;
  /// Waits until all keyframes are processed, then calls RgbdLoopCloser::finish(). More keyframes may follow.
  RgbdAlignmentReport finish(const RunContext& run = {}, const KeyframeDepths& depths = {});
  /// The pose graph; call only when no keyframe is waiting, e.g. after finish().
  [[nodiscard]] const PoseGraph3D& graph() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
