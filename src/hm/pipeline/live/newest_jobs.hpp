#pragma once
#include <condition_variable>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

namespace hm {

/// Does the newest job of each name on a thread of its own, the name that waits longest first; a job that
/// waits while a newer one of its name comes is dropped.
template <class Name = int, class Less = std::less<Name>>
class NewestJobs {
 public:
  NewestJobs() : thread_([this] { run(); }) {}
  /// Drops what waits.
  ~NewestJobs() {
    {
      const std::lock_guard lock(mutex_);
      stopped_ = true;
    }
    changed_.notify_all();
    thread_.join();
  }
  NewestJobs(const NewestJobs&) = delete;
  NewestJobs& operator=(const NewestJobs&) = delete;

  /// Returns at once.
  void give(const Name& name, std::function<void()> job) {
    {
      const std::lock_guard lock(mutex_);
      add(name, std::move(job));
    }
    changed_.notify_all();
  }
  void give(std::vector<std::pair<Name, std::function<void()>>> jobs) {
    if (jobs.empty()) return;
    {
      const std::lock_guard lock(mutex_);
      for (auto& [name, job] : jobs) add(name, std::move(job));
    }
    changed_.notify_all();
  }
  void wait() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return waiting_.empty() && !busy_; });
  }

 private:
  void add(const Name& name, std::function<void()> job) {
    if (waiting_.insert_or_assign(name, std::move(job)).second) order_.push_back(name);
  }
  void run() {
    std::unique_lock lock(mutex_);
    while (true) {
      changed_.wait(lock, [this] { return stopped_ || !waiting_.empty(); });
      if (stopped_) return;
      const auto job = std::move(waiting_.extract(order_.front()).mapped());
      order_.pop_front();
      busy_ = true;
      lock.unlock();
      job();
      lock.lock();
      busy_ = false;
      if (waiting_.empty()) changed_.notify_all();
    }
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<Name, std::function<void()>, Less> waiting_;
  std::deque<Name> order_;  ///< of those that wait
  bool busy_ = false, stopped_ = false;
  std::thread thread_;
};

}  // namespace hm
