#include "hm/slam/rgbd/live_rgbd_loop_closer.hpp"

#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>
#include <utility>

#include "hm/core/check.hpp"

namespace hm {

namespace {

/// Poses are published again when this share of the keyframes (one in so many) is new.
constexpr std::size_t kPublishedShare = 20;

}  // namespace

struct LiveRgbdLoopCloser::Impl {
  RgbdLoopCloser closer;     ///< used by the worker, or by finish() while the worker waits
  mutable std::mutex mutex;  ///< protects all members below
  std::condition_variable changed;
  std::deque<std::shared_ptr<const Keyframe>> queue;
  bool busy = false, ending = false;
  Snapshot latest;
  std::size_t published = 0;  ///< number of keyframes with poses in `latest`; used by the worker
  int published_submap = -1;
  std::thread worker;

  Impl(const PinholeCamera& camera, const RgbdLoopParams& params) : closer(camera, params) {
    latest.corrected = std::make_shared<const CorrectedKeyframes>();
  }
  void work();
  void publish();
  void publish_after(const RgbdLoopStep& step, const Keyframe& keyframe);
};

/// Publishes poses when they have changed or a submap begins, else at intervals: until then the last known
/// keyframe gives the same correction for newer ones.
void LiveRgbdLoopCloser::Impl::publish_after(const RgbdLoopStep& step, const Keyframe& keyframe) {
  const std::size_t keyframes = step.node + 1;
  const bool is_new = step.solved || keyframe.submap != published_submap;
  if (is_new || kPublishedShare * (keyframes - published) >= keyframes) {
    published = keyframes;
    published_submap = keyframe.submap;
    return publish();
  }
  const std::lock_guard lock(mutex);
  latest.statistics = closer.statistics();
}

/// Must be called with exclusive access to the closer and without holding the mutex.
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
    const Keyframe& added = *keyframe;
    const RgbdLoopStep step = closer.add(keyframe);
    publish_after(step, added);
    lock.lock();
    busy = false;
    changed.notify_all();
  }
}

LiveRgbdLoopCloser::LiveRgbdLoopCloser(const PinholeCamera& camera, const RgbdLoopParams& params,
                                       ThreadPriority priority)
    : impl_(std::make_unique<Impl>(camera, params)) {
  impl_->worker = std::thread([this, priority] {
    set_thread_priority(priority);
    impl_->work();
  });
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

RgbdAlignmentReport LiveRgbdLoopCloser::finish(const RunContext& run, const KeyframeDepths& depths) {
  {
    std::unique_lock lock(impl_->mutex);
    impl_->changed.wait(lock, [this] { return impl_->queue.empty() && !impl_->busy; });
  }
  // The worker sleeps until add() is called again, by this thread.
  const RgbdAlignmentReport report = impl_->closer.finish(run, depths);
  impl_->publish();
  return report;
}

const PoseGraph3D& LiveRgbdLoopCloser::graph() const {
  const std::lock_guard lock(impl_->mutex);
  HM_CHECK(impl_->queue.empty() && !impl_->busy, "keyframes are waiting");
  return impl_->closer.graph();
}

}  // namespace hm
