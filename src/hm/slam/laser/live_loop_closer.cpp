#include "hm/slam/laser/live_loop_closer.hpp"

#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>

namespace hm {

struct LiveLoopCloser::Impl {
  explicit Impl(const ScanGraph2DParams& params) : closer(params) {}
  void work();
  void wait_until_settled();

  struct Waiting {
    PlanarScan scan;
    OdometryStep step;
  };
  LoopCloser closer;         ///< used by the worker while scans wait, else by the caller
  mutable std::mutex mutex;  ///< protects all members below
  std::condition_variable changed;
  std::deque<Waiting> queue;
  bool busy = false, ending = false;
  SE2 T_map_odom;
  std::thread worker;  ///< none where the caller does the work
};

void LiveLoopCloser::Impl::work() {
  std::unique_lock lock(mutex);
  while (true) {
    changed.wait(lock, [this] { return ending || !queue.empty(); });
    if (ending) return;
    const Waiting next = std::move(queue.front());
    queue.pop_front();
    busy = true;
    lock.unlock();
    closer.add(next.scan, next.step);
    lock.lock();
    T_map_odom = closer.T_map_odom();
    busy = false;
    changed.notify_all();
  }
}

void LiveLoopCloser::Impl::wait_until_settled() {
  std::unique_lock lock(mutex);
  changed.wait(lock, [this] { return queue.empty() && !busy; });
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
  if (!impl_->worker.joinable()) {
    impl_->closer.add(scan, step);
    impl_->T_map_odom = impl_->closer.T_map_odom();
    return;
  }
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->queue.push_back({scan, step});
  }
  impl_->changed.notify_all();
}

SE2 LiveLoopCloser::T_map_odom() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->T_map_odom;
}

std::size_t LiveLoopCloser::waiting_scans() const {
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
  impl_->T_map_odom = impl_->closer.T_map_odom();
  return solution;
}

}  // namespace hm
