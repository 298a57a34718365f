#include "hm/slam/laser/live_loop_closer.hpp"

#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>

namespace hm {

struct LiveLoopCloser::Impl {
  explicit Impl(const ScanGraph2DParams& params) : keyframes(params), closer(params) {}
  void work();
  void process(const GraphKeyframe2D& keyframe);
  void wait_until_settled();
  void throw_failure() {
    if (failure) std::rethrow_exception(std::exchange(failure, nullptr));
  }

  GraphKeyframes keyframes;  ///< used by add()
  LoopCloser closer;         ///< used by the worker while keyframes wait, else by the caller
  mutable std::mutex mutex;  ///< protects all members below
  std::condition_variable changed;
  std::deque<GraphKeyframe2D> queue;
  bool busy = false, ending = false;
  std::exception_ptr failure;  ///< of the worker
  SE2 T_map_odom;
  std::thread worker;  ///< none where the caller does the work
};

void LiveLoopCloser::Impl::process(const GraphKeyframe2D& keyframe) {
  closer.add(keyframe);
  const std::lock_guard lock(mutex);
  T_map_odom = closer.T_map_odom();
}

void LiveLoopCloser::Impl::work() {
  std::unique_lock lock(mutex);
  while (true) {
    changed.wait(lock, [this] { return ending || !queue.empty(); });
    if (ending) return;
    const GraphKeyframe2D next = std::move(queue.front());
    queue.pop_front();
    busy = true;
    lock.unlock();
    std::exception_ptr failed;
    try {
      process(next);
    } catch (...) {
      failed = std::current_exception();
    }
    lock.lock();
    busy = false;
    if (failed) {
      failure = failed;
      queue.clear();
    }
    changed.notify_all();
  }
}

void LiveLoopCloser::Impl::wait_until_settled() {
  std::unique_lock lock(mutex);
  changed.wait(lock, [this] { return queue.empty() && !busy; });
  throw_failure();
}

LiveLoopCloser::LiveLoopCloser(const ScanGraph2DParams& params, LoopThread thread)
    : impl_(std::make_unique<Impl>(params)) {
  if (thread == LoopThread::kOwn) impl_->worker = std::thread([this] { impl_->work(); });
}

LiveLoopCloser::~LiveLoopCloser() {
  if (!impl_->worker.joinable()) return;
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->ending = true;
  }
  impl_->changed.notify_all();
  impl_->worker.join();
}

void LiveLoopCloser::add(const PlanarScan& scan, const OdometryStep& step) {
  auto keyframe = impl_->keyframes.add(scan, step);
  if (!keyframe) return;
  if (!impl_->worker.joinable()) return impl_->process(*keyframe);
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->throw_failure();
    impl_->queue.push_back(std::move(*keyframe));
  }
  impl_->changed.notify_all();
}

SE2 LiveLoopCloser::T_map_odom() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->T_map_odom;
}

std::size_t LiveLoopCloser::waiting_keyframes() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->queue.size() + (impl_->busy ? 1 : 0);
}

const LoopCloser& LiveLoopCloser::settled() const {
  impl_->wait_until_settled();
  return impl_->closer;
}

PoseGraphSolution LiveLoopCloser::finish() {
  impl_->wait_until_settled();
  // The worker sleeps until add() is called again, by this thread.
  const PoseGraphSolution solution = impl_->closer.finish();
  const std::lock_guard lock(impl_->mutex);
  impl_->T_map_odom = impl_->closer.T_map_odom();
  return solution;
}

}  // namespace hm
