#include "hm/pipeline/scan/scan_recorder.hpp"

#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "hm/core/check.hpp"
#include "hm/core/thread_priority.hpp"

namespace hm {
namespace {

/// From so many waiting frames on images are stored uncompressed: a quarter of a second at 30 Hz.
constexpr std::size_t kBehind = 8;
/// Frames between two syncs to disk, at least; a sync takes about a millisecond a frame.
constexpr std::size_t kSyncInterval = 30;

}  // namespace

struct ScanRecorder::Impl {
  Impl(TumWriter to, std::size_t frames) : writer(std::move(to)), most(frames) {}

  TumWriter writer;  // of the writing thread until it has ended
  std::size_t most;
  mutable std::mutex mutex;
  mutable std::condition_variable changed;
  std::deque<std::shared_ptr<const RgbdFrame>> queue;  ///< the first one is being written
  bool closed = false;
  RecorderCounts counts;
  std::optional<Error> failure;
  std::thread thread;

  void write_all();
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
  const std::scoped_lock lock(mutex);
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
  std::size_t since_sync = 0;
  while (true) {
    std::shared_ptr<const RgbdFrame> frame;
    bool is_behind = false;
    {
      std::unique_lock lock(mutex);
      changed.wait(lock, [&] { return !queue.empty() || closed; });
      if (queue.empty()) return;
      frame = queue.front();
      is_behind = queue.size() > kBehind;
    }
    write(*frame, is_behind ? PngEffort::kStored : PngEffort::kFast);
    if (++since_sync < kSyncInterval || is_behind) continue;
    since_sync = 0;
    const auto synced = writer.sync();
    const std::scoped_lock lock(mutex);
    note(synced);
  }
}

ScanRecorder::ScanRecorder(TumWriter writer, std::size_t queue_frames)
    : impl_(std::make_unique<Impl>(std::move(writer), queue_frames)) {
  HM_CHECK(queue_frames >= 1, "queue_frames = {}", queue_frames);
  impl_->thread = std::thread([impl = impl_.get()] {
    set_thread_priority(ThreadPriority::kLow);
    impl->write_all();
  });
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
