#pragma once
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <stop_token>
#include <thread>
#include <utility>

#include "hm/core/thread_priority.hpp"

namespace hm {

/// Processes items one by one, in the order in which they come, on a thread of its own. waiting() is called
/// from any thread, the others from one. The destructor waits for the item that is processed; those that wait
/// are dropped.
template <class Item>
class WorkQueue {
 public:
  explicit WorkQueue(std::function<void(const Item&)> process,
                     ThreadPriority priority = ThreadPriority::kNormal)
      : process_(std::move(process)), thread_([this, priority](const std::stop_token& stop) {
          set_thread_priority(priority);
          run(stop);
        }) {}

  /// Returns at once. Throws what processing an earlier item threw, then and from then on: the items behind
  /// that one, and this one, are dropped.
  void add(Item item) {
    {
      const std::lock_guard lock(mutex_);
      throw_failure();
      items_.push_back(std::move(item));
    }
    changed_.notify_all();
  }
  /// Items that are not yet processed.
  [[nodiscard]] std::size_t waiting() const {
    const std::lock_guard lock(mutex_);
    return items_.size() + (busy_ ? 1 : 0);
  }
  /// Waits until all items are processed. The thread is then idle, and what it used is the caller's until the
  /// next add(). Throws as add() does.
  void wait() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return items_.empty() && !busy_; });
    throw_failure();
  }

 private:
  void run(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    while (true) {
      changed_.wait(lock, stop, [this] { return !items_.empty(); });
      if (stop.stop_requested()) return;
      const Item item = std::move(items_.front());
      items_.pop_front();
      busy_ = true;
      lock.unlock();
      std::exception_ptr failure;
      try {
        process_(item);
      } catch (...) {
        failure = std::current_exception();
      }
      lock.lock();
      busy_ = false;
      if (failure) {
        failure_ = failure;
        items_.clear();
      }
      changed_.notify_all();
    }
  }
  void throw_failure() {
    if (failure_) std::rethrow_exception(failure_);
  }

  std::function<void(const Item&)> process_;
  mutable std::mutex mutex_;  ///< protects all members below but the thread
  std::condition_variable_any changed_;
  std::deque<Item> items_;
  bool busy_ = false;
  std::exception_ptr failure_;
  std::jthread thread_;  // last: stops before the other members are destroyed
};

}  // namespace hm
