#pragma once
#include <cstddef>
#include <memory>

#include "hm/slam/laser/loop_closer.hpp"

namespace hm {

/// Where loops are searched for and the graph is solved: while add() is called, or on a thread of its own.
enum class LoopThread { kCaller, kOwn };

/// A LoopCloser that odometry need not wait for: a search through a large building or a solution of its graph
/// can take longer than the time between scans. On a thread of its own, T_map_odom() depends on that thread's
/// progress; after finish() the graph is the same, bit by bit, as a LoopCloser's. add(), settled() and
/// finish() are called by one thread.
class LiveLoopCloser {
 public:
  explicit LiveLoopCloser(const ScanGraph2DParams& params = {}, LoopThread thread = LoopThread::kOwn);
  /// Waits for the current scan; those in the queue are dropped.
  ~LiveLoopCloser();
  LiveLoopCloser(const LiveLoopCloser&) = delete;
  LiveLoopCloser& operator=(const LiveLoopCloser&) = delete;

  /// Takes the odometry result of a scan into account; on a thread of its own: queues a copy and returns at
  /// once.
  void add(const PlanarScan& scan, const OdometryStep& step);
  /// The correction `map -> odom` by the scans processed so far.
  [[nodiscard]] SE2 T_map_odom() const;
  /// Scans that are not yet processed.
  [[nodiscard]] std::size_t waiting_scans() const;
  /// Waits until all scans are processed. Valid until the next add().
  [[nodiscard]] const LoopCloser& settled() const;
  /// Waits likewise, then optimises the whole graph.
  PoseGraphSolution finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
