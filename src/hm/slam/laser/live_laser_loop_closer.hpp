#pragma once
#include <cstddef>
#include <memory>

#include "hm/slam/laser/laser_loop_closer.hpp"

namespace hm {

/// Where loops are searched for and the graph is solved: while add() is called, or on a thread of its own.
enum class LoopThread { kCaller, kOwn };

/// A LaserLoopCloser that odometry need not wait for: a search through a large building or a solution of its
/// graph can take longer than the time between scans. On a thread of its own, T_map_odom() depends on that
/// thread's progress; after finish() the graph is the same, bit by bit, as a LaserLoopCloser's. T_map_odom()
/// and waiting_keyframes() are called from any thread, the others from one. An exception of the thread
/// (std::bad_alloc) is thrown by add(), settled() and finish() from then on.
class LiveLaserLoopCloser {
 public:
  LiveLaserLoopCloser(const ScanGraph2DParams& params, LoopThread thread);
  /// Waits for the keyframe that is processed; those in the queue are dropped.
  ~LiveLaserLoopCloser();
  LiveLaserLoopCloser(const LiveLaserLoopCloser&) = delete;
  LiveLaserLoopCloser& operator=(const LiveLaserLoopCloser&) = delete;

  /// Takes the odometry result of a scan into account. On a thread of its own: scans that become a keyframe
  /// are copied into a queue (the graph keeps as much of them), and it returns at once.
  void add(const PlanarScan& scan, const OdometryStep& step, double height_m = 0);
  /// The correction `map -> odom` by the keyframes processed so far.
  [[nodiscard]] SE2 T_map_odom() const;
  /// Keyframes that are not yet processed.
  [[nodiscard]] std::size_t waiting_keyframes() const;
  /// Waits until all keyframes are processed. Valid until the next add().
  [[nodiscard]] const LaserLoopCloser& settled() const;
  /// Waits likewise, then as LaserLoopCloser::finish().
  PoseGraphSolution finish(const RunContext& run = {});

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
