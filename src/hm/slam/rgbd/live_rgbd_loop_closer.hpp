#pragma once
#include <cstddef>
#include <memory>

#include "hm/slam/rgbd/rgbd_loop_closer.hpp"

namespace hm {

/// A loop closer on a thread of its own, so that tracking never waits. Which keyframes a result already knows
/// of depends on the machine's speed; after finish() the result is that of RgbdLoopCloser.
class LiveRgbdLoopCloser {
 public:
  explicit LiveRgbdLoopCloser(const PinholeCamera& camera, const RgbdLoopParams& params = {});
  /// Ends after the keyframe in work; those still waiting are dropped.
  ~LiveRgbdLoopCloser();
  LiveRgbdLoopCloser(const LiveRgbdLoopCloser&) = delete;
  LiveRgbdLoopCloser& operator=(const LiveRgbdLoopCloser&) = delete;

  /// Latest result.
  struct Snapshot {
    std::shared_ptr<const CorrectedKeyframes> corrected;  ///< never null
    std::size_t solutions = 0;  ///< counts up when poses have changed, so that a map can follow
    RgbdLoopStatistics statistics;
    std::size_t waiting_keyframes = 0;  ///< not looked at yet
  };

  /// Hands over a keyframe and returns at once. May be called from one thread; snapshot() from any.
  void add(std::shared_ptr<const Keyframe> keyframe);
  [[nodiscard]] Snapshot snapshot() const;
  /// Waits until all keyframes are worked in, then RgbdLoopCloser::finish(). More keyframes may follow.
  RgbdAlignmentReport finish(const RunContext& run = {});
  /// The pose graph; only when no keyframe is waiting, as after finish().
  [[nodiscard]] const PoseGraph3D& graph() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
