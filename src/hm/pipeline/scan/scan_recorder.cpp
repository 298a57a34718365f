#include "hm/pipeline/scan/scan_recorder.hpp"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <stop_token>
#include <thread>
#include <utility>
#include <vector>

#include "hm/core/check.hpp"
#include "hm/core/thread_priority.hpp"

namespace hm {
namespace {

/// From so many waiting frames on images are stored uncompressed: a quarter of a second at 30 Hz.
constexpr std::size_t kBehind = 8;
/// Between two syncs to disk: what is written in this time is synced in a tenth of it on a fast disk.
constexpr std::chrono::milliseconds kSyncInterval{500};

}  // namespace

struct ScanRecorder::Impl {
  Impl(TumWriter to, std::size_t frames) : writer(std::move(to)), most(frames) {}

  TumWriter writer;  // of the writing thread until it has ended
  std::size_t most;
  mutable std::mutex mutex;
  mutable std::condition_variable changed;
  std::condition_variable_any changed_or_stopped;
  std::deque<std::shared_ptr<const RgbdFrame>> queue;  ///< the first one is being written
  bool closed = false;
  RecorderCounts counts;
  std::optional<Error> failure;
  std::vector<std::filesystem::path> unsynced;
  std::thread thread;
  std::jthread syncer;  ///< a slow disk delays no frame

  void write_all();
  void write_rest();
  void sync_all(const std::stop_token& stop);
  bool stop_requested_within(std::unique_lock<std::mutex>& lock, const std::stop_token& stop);
  void write(const RgbdFrame& frame, PngEffort effort);
  void note(const Result<void>& written);
};

void ScanRecorder::Impl::note(const Result<void>& written) {
  if (written || failure) return;
  failure = written.error();
  counts.failure = to_string(*failure);
}

void ScanRecorder::Impl::write(const RgbdFrame& frame, PngEffort effort) {
  const auto written = writer.add(frame, effort);
  const auto files = writer.take_unsynced();
  const std::scoped_lock lock(mutex);
  unsynced.insert(unsynced.end(), files.begin(), files.end());
  queue.pop_front();
  if (written) {
    ++counts.recorded;
    counts.uncompressed += effort == PngEffort::kStored;
  } else {
    ++counts.failed;
  }
  note(written);
  changed.notify_all();
}

void ScanRecorder::Impl::write_all() {
  while (true) {
    std::shared_ptr<const RgbdFrame> frame;
    bool is_behind = false;
    {
      std::unique_lock lock(mutex);
      changed.wait(lock, [&] { return !queue.empty() || closed; });
      if (closed) return;  // finish() writes the rest, at its own priority
      frame = queue.front();
      is_behind = queue.size() > kBehind;
    }
    write(*frame, is_behind ? PngEffort::kStored : PngEffort::kFast);
  }
}

/// After the writing thread has ended: whoever waits for it has no time for compression.
void ScanRecorder::Impl::write_rest() {
  while (true) {
    std::shared_ptr<const RgbdFrame> frame;
    {
      const std::scoped_lock lock(mutex);
      if (queue.empty()) return;
      frame = queue.front();
    }
    write(*frame, PngEffort::kStored);
  }
}

/// The last time after everything was written.
void ScanRecorder::Impl::sync_all(const std::stop_token& stop) {
  std::unique_lock lock(mutex);
  for (bool is_last = false; !is_last;) {
    is_last = stop_requested_within(lock, stop);
    auto files = std::exchange(unsynced, {});
    std::sort(files.begin(), files.end());
    files.erase(std::unique(files.begin(), files.end()), files.end());
    lock.unlock();
    const auto synced = sync_files(files);
    lock.lock();
    note(synced);
  }
}

bool ScanRecorder::Impl::stop_requested_within(std::unique_lock<std::mutex>& lock,
                                               const std::stop_token& stop) {
  changed_or_stopped.wait_for(lock, stop, kSyncInterval, [] { return false; });
  return stop.stop_requested();
}

ScanRecorder::ScanRecorder(TumWriter writer, std::size_t queue_frames)
    : impl_(std::make_unique<Impl>(std::move(writer), queue_frames)) {
  HM_CHECK(queue_frames >= 1, "queue_frames = {}", queue_frames);
  impl_->thread = std::thread([impl = impl_.get()] {
    set_thread_priority(ThreadPriority::kLow);
    impl->write_all();
  });
  impl_->syncer = std::jthread([impl = impl_.get()](const std::stop_token& stop) { impl->sync_all(stop); });
}

ScanRecorder::~ScanRecorder() { (void)finish(); }

void ScanRecorder::offer(std::shared_ptr<const RgbdFrame> frame) {
  const std::scoped_lock lock(impl_->mutex);
  HM_CHECK(!impl_->closed, "offer() after finish()");
  if (impl_->queue.size() >= impl_->most) {
    ++impl_->counts.queue_full;
    return;
  }
  impl_->queue.push_back(std::move(frame));
  impl_->changed.notify_all();
}

void ScanRecorder::wait_for(Time stamp) const {
  std::unique_lock lock(impl_->mutex);
  impl_->changed.wait(lock, [&] { return impl_->queue.empty() || impl_->queue.front()->stamp > stamp; });
}

Result<void> ScanRecorder::finish() {
  if (impl_->thread.joinable()) {
    {
      const std::scoped_lock lock(impl_->mutex);
      impl_->closed = true;
      impl_->changed.notify_all();
    }
    impl_->thread.join();
    impl_->write_rest();
    impl_->syncer.request_stop();
    impl_->syncer.join();
    impl_->note(impl_->writer.finish());
  }
  if (impl_->failure) return tl::make_unexpected(*impl_->failure);
  return {};
}

RecorderCounts ScanRecorder::counts() const {
  const std::scoped_lock lock(impl_->mutex);
  return impl_->counts;
}

}  // namespace hm
