#include "hm/slam/rgbd/live_rgbd_loop_closer.hpp"

#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>
#include <utility>

#include "hm/core/check.hpp"

namespace hm {

struct LiveRgbdLoopCloser::Impl {
  RgbdLoopCloser closer;     ///< the worker's, or finish()'s while the worker waits
  mutable std::mutex mutex;  ///< of all below
  std::condition_variable changed;
  std::deque<std::shared_ptr<const Keyframe>> queue;
  bool busy = false, ending = false;
  Snapshot latest;
  std::thread worker;

  Impl(const PinholeCamera& camera, const RgbdLoopParams& params) : closer(camera, params) {
    latest.corrected = std::make_shared<const CorrectedKeyframes>();
  }
  void work();
  void publish();
};

/// Called with nobody else at the closer and the mutex free.
void LiveRgbdLoopCloser::Impl::publish() {
  Snapshot fresh;
  fresh.corrected = std::make_shared<const CorrectedKeyframes>(closer.corrected());
  fresh.statistics = closer.statistics();
  fresh.solutions = fresh.statistics.solutions;
  const std::lock_guard lock(mutex);
  latest = std::move(fresh);
}

void LiveRgbdLoopCloser::Impl::work() {
  std::unique_lock lock(mutex);
  while (true) {
    changed.wait(lock, [this] { return ending || !queue.empty(); });
    if (ending) return;
    std::shared_ptr<const Keyframe> keyframe = std::move(queue.front());
    queue.pop_front();
    busy = true;
    lock.unlock();
    closer.add(std::move(keyframe));
    publish();
    lock.lock();
    busy = false;
    changed.notify_all();
  }
}

LiveRgbdLoopCloser::LiveRgbdLoopCloser(const PinholeCamera& camera, const RgbdLoopParams& params)
    : impl_(std::make_unique<Impl>(camera, params)) {
  impl_->worker = std::thread([this] { impl_->work(); });
}

LiveRgbdLoopCloser::~LiveRgbdLoopCloser() {
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->ending = true;
  }
  impl_->changed.notify_all();
  impl_->worker.join();
}

void LiveRgbdLoopCloser::add(std::shared_ptr<const Keyframe> keyframe) {
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->queue.push_back(std::move(keyframe));
  }
  impl_->changed.notify_all();
}

LiveRgbdLoopCloser::Snapshot LiveRgbdLoopCloser::snapshot() const {
  const std::lock_guard lock(impl_->mutex);
  Snapshot snapshot = impl_->latest;
  snapshot.waiting_keyframes = impl_->queue.size() + (impl_->busy ? 1 : 0);
  return snapshot;
}

RgbdAlignmentReport LiveRgbdLoopCloser::finish(const RunContext& run) {
  {
    std::unique_lock lock(impl_->mutex);
    impl_->changed.wait(lock, [this] { return impl_->queue.empty() && !impl_->busy; });
  }
  // The worker sleeps until add() is called again, which is this thread's to do.
  const RgbdAlignmentReport report = impl_->closer.finish(run);
  impl_->publish();
  return report;
}

const PoseGraph3D& LiveRgbdLoopCloser::graph() const {
  const std::lock_guard lock(impl_->mutex);
  HM_CHECK(impl_->queue.empty() && !impl_->busy, "keyframes are waiting");
  return impl_->closer.graph();
}

}  // namespace hm
