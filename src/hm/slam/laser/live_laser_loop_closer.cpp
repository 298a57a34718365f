#include "hm/slam/laser/live_laser_loop_closer.hpp"

#include <mutex>
#include <optional>
#include <utility>

#include "hm/slam/work_queue.hpp"

namespace hm {

struct LiveLaserLoopCloser::Impl {
  explicit Impl(const ScanGraph2DParams& params) : keyframes(params), closer(params) {}
  void process(const GraphKeyframe2D& keyframe) {
    closer.add(keyframe);
    publish();
  }
  void publish() {
    const std::lock_guard lock(mutex);
    T_map_odom = closer.T_map_odom();
  }
  void wait() {
    if (queue) queue->wait();
  }

  GraphKeyframes keyframes;  ///< used by add()
  LaserLoopCloser closer;    ///< used by the queue while keyframes wait, else by the caller
  mutable std::mutex mutex;  ///< protects T_map_odom
  SE2 T_map_odom;
  std::optional<WorkQueue<GraphKeyframe2D>> queue;  // last: ends first. None where the caller does the work
};

LiveLaserLoopCloser::LiveLaserLoopCloser(const ScanGraph2DParams& params, LoopThread thread)
    : impl_(std::make_unique<Impl>(params)) {
  if (thread == LoopThread::kOwn)
    impl_->queue.emplace([impl = impl_.get()](const GraphKeyframe2D& keyframe) { impl->process(keyframe); });
}

LiveLaserLoopCloser::~LiveLaserLoopCloser() = default;

void LiveLaserLoopCloser::add(const PlanarScan& scan, const OdometryStep& step, double height_m) {
  auto keyframe = impl_->keyframes.add(scan, step, height_m);
  if (!keyframe) return;
  if (!impl_->queue) return impl_->process(*keyframe);
  impl_->queue->add(std::move(*keyframe));
}

SE2 LiveLaserLoopCloser::T_map_odom() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->T_map_odom;
}

std::size_t LiveLaserLoopCloser::waiting_keyframes() const {
  return impl_->queue ? impl_->queue->waiting() : 0;
}

const LaserLoopCloser& LiveLaserLoopCloser::settled() const {
  impl_->wait();
  return impl_->closer;
}

PoseGraphSolution LiveLaserLoopCloser::finish(const RunContext& run) {
  impl_->wait();
  const PoseGraphSolution solution = impl_->closer.finish(run);
  impl_->publish();
  return solution;
}

}  // namespace hm
