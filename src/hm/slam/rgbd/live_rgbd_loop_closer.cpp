#include "hm/slam/rgbd/live_rgbd_loop_closer.hpp"

#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>
#include <utility>

#include "hm/core/check.hpp"

namespace hm {

namespace {

/// Poses are copied again when this share of the keyframes is new.
constexpr std::size_t kPublishedShare = 20;

}  // namespace

struct LiveRgbdLoopCloser::Impl {
  RgbdLoopCloser closer;     ///< the worker's, or finish()'s while the worker waits
  mutable std::mutex mutex;  ///< of all below
  std::condition_variable changed;
  std::deque<std::shared_ptr<const Keyframe>> queue;
  bool busy = false, ending = false;
  Snapshot latest;
  std::size_t published = 0;  ///< keyframes whose poses `latest` has; the worker's
  int published_submap = -1;
  std::thread worker;

  Impl(const PinholeCamera& camera, const RgbdLoopParams& params) : closer(camera, params) {
    latest.corrected = std::make_shared<const CorrectedKeyframes>();
  }
  void work();
  void publish();
  void publish_after(const RgbdLoopStep& step, const Keyframe& keyframe);
};

/// Poses are copied when something has moved or a submap begins, else now and then: until then the last
/// keyframe known carries newer ones to the same places.
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
    const Keyframe& added = *keyframe;
    const RgbdLoopStep step = closer.add(keyframe);
    publish_after(step, added);
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
