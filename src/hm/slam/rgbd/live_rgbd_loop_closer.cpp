#include "hm/slam/rgbd/live_rgbd_loop_closer.hpp"

#include <mutex>
#include <utility>

#include "hm/core/check.hpp"
#include "hm/slam/work_queue.hpp"

namespace hm {

namespace {

/// Poses are published again when this share of the keyframes (one in so many) is new.
constexpr std::size_t kPublishedShare = 20;

}  // namespace

struct LiveRgbdLoopCloser::Impl {
  RgbdLoopCloser closer;     ///< used by the queue while keyframes wait, else by the caller
  mutable std::mutex mutex;  ///< protects `latest`
  Snapshot latest;
  std::size_t published = 0;  ///< number of keyframes with poses in `latest`; used by the queue
  int published_submap = -1;
  WorkQueue<std::shared_ptr<const Keyframe>> queue;  // last: ends first

  Impl(const PinholeCamera& camera, const RgbdLoopParams& params, ThreadPriority priority)
      : closer(camera, params),
        queue([this](const auto& keyframe) { publish_after(closer.add(keyframe), *keyframe); }, priority) {
    latest.corrected = std::make_shared<const CorrectedKeyframes>();
  }
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

LiveRgbdLoopCloser::LiveRgbdLoopCloser(const PinholeCamera& camera, const RgbdLoopParams& params,
                                       ThreadPriority priority)
    : impl_(std::make_unique<Impl>(camera, params, priority)) {}

LiveRgbdLoopCloser::~LiveRgbdLoopCloser() = default;

void LiveRgbdLoopCloser::add(std::shared_ptr<const Keyframe> keyframe) {
  impl_->queue.add(std::move(keyframe));
}

LiveRgbdLoopCloser::Snapshot LiveRgbdLoopCloser::snapshot() const {
  const std::size_t waiting = impl_->queue.waiting();  // before the result: with none, the result is of all
  const std::lock_guard lock(impl_->mutex);
  Snapshot snapshot = impl_->latest;
  snapshot.waiting_keyframes = waiting;
  return snapshot;
}

RgbdAlignmentReport LiveRgbdLoopCloser::finish(const RunContext& run, const KeyframeDepths& depths) {
  impl_->queue.wait();
  const RgbdAlignmentReport report = impl_->closer.finish(run, depths);
  impl_->publish();
  return report;
}

const PoseGraph3D& LiveRgbdLoopCloser::graph() const {
  HM_CHECK(impl_->queue.waiting() == 0, "keyframes are waiting");
  return impl_->closer.graph();
}

}  // namespace hm
