#pragma once
#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

namespace hm {

/// Hands content over from one thread to another, which polls for it: to wake a thread costs more than
/// that.
template <class Content>
class Handover {
 public:
  using Period = std::chrono::steady_clock::duration;
  /// `look`, on a thread of its own, takes what there is and says whether there was anything to do: it is
  /// called every `period`, until there was nothing for `rest`, and again when something is given.
  explicit Handover(std::function<bool()> look, Period period = std::chrono::milliseconds(20),
                    Period rest = std::chrono::seconds(1))
      : look_(std::move(look)), period_(period), rest_(rest), thread_([this] { run(); }) {}
  /// Drops what was not taken.
  ~Handover() {
    {
      const std::lock_guard lock(mutex_);
      stopped_ = true;
    }
    changed_.notify_all();
    thread_.join();
  }
  Handover(const Handover&) = delete;
  Handover& operator=(const Handover&) = delete;

  /// Any thread: `change` adds to the content, quickly.
  template <class Change>
  void give(Change&& change) {
    bool was_resting = false;
    {
      const std::lock_guard lock(mutex_);
      change(content_);
      was_resting = std::exchange(is_resting_, false);
    }
    if (was_resting) changed_.notify_all();
  }
  /// Any thread: what was given since the last time, for `taken`, whose memory is used for what comes next.
  void take(Content& taken) {
    const std::lock_guard lock(mutex_);
    std::swap(content_, taken);
  }

 private:
  void run() {
    Period idle{};
    std::unique_lock lock(mutex_);
    while (!stopped_) {
      if (idle < rest_) {
        changed_.wait_for(lock, period_, [this] { return stopped_; });
      } else {
        is_resting_ = true;
        changed_.wait(lock, [this] { return stopped_ || !is_resting_; });
      }
      lock.unlock();
      idle = look_() ? Period{} : idle + period_;
      lock.lock();
    }
  }

  std::function<bool()> look_;
  Period period_, rest_;
  std::mutex mutex_;
  std::condition_variable changed_;
  Content content_;
  bool is_resting_ = false, stopped_ = false;
  std::thread thread_;
};

}  // namespace hm
