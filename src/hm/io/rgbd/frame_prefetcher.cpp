#include <algorithm>
#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <stop_token>
#include <thread>

#include "hm/io/rgbd/recording.hpp"

namespace hm {

struct FramePrefetcher::Impl {
  const FrameSource* frames = nullptr;
  std::vector<std::size_t> indices;
  PrefetchOptions options;
  std::mutex mutex;  ///< protects all members below but the readers
  std::condition_variable_any changed;
  std::size_t taken = 0;  ///< frames that next() has returned
  /// Those that follow: what is being read has no value yet. At most options.ahead.
  std::deque<std::optional<Result<RgbdFrame>>> begun;
  std::exception_ptr failure;         ///< of a reader
  std::vector<std::jthread> readers;  // last: stop before the other members are destroyed

  void read_all(const std::stop_token& stop);
  [[nodiscard]] bool all_begun() const { return taken + begun.size() >= indices.size(); }
};

void FramePrefetcher::Impl::read_all(const std::stop_token& stop) {
  std::unique_lock lock(mutex);
  while (true) {
    // Waits for room before decoding, so that at most `ahead` frames are held.
    changed.wait(lock, stop, [&] { return failure || all_begun() || begun.size() < options.ahead; });
    if (stop.stop_requested() || failure || all_begun()) return;
    const std::size_t place = taken + begun.size();
    begun.emplace_back();
    lock.unlock();
    std::optional<Result<RgbdFrame>> frame;
    std::exception_ptr thrown;
    try {
      const std::size_t index = indices[place];
      frame.emplace(options.depth_only ? frames->read_depth(index) : frames->read(index));
    } catch (...) {
      thrown = std::current_exception();
    }
    lock.lock();
    if (thrown) failure = thrown;
    begun[place - taken] = std::move(frame);
    changed.notify_all();
  }
}

namespace {

std::vector<std::size_t> every(std::size_t stride, std::size_t begin, std::size_t end) {
  HM_CHECK(stride >= 1, "stride = {}", stride);
  std::vector<std::size_t> indices;
  for (std::size_t i = begin; i < end; i += std::min(stride, end - i)) indices.push_back(i);
  return indices;
}

}  // namespace

FramePrefetcher::FramePrefetcher(const Recording& recording, std::size_t begin, std::size_t end,
                                 std::size_t stride, const PrefetchOptions& options)
    : FramePrefetcher(recording, every(stride, begin, std::min(end, recording.info().frame_count)), options) {
}

FramePrefetcher::FramePrefetcher(const FrameSource& frames, std::vector<std::size_t> indices,
                                 const PrefetchOptions& options)
    : impl_(std::make_unique<Impl>()) {
  HM_CHECK(options.ahead >= 1 && options.readers >= 1, "{} frames ahead by {} readers", options.ahead,
           options.readers);
  impl_->frames = &frames;
  impl_->indices = std::move(indices);
  impl_->options = options;
  impl_->options.ahead = std::max(options.ahead, static_cast<std::size_t>(options.readers));
  const std::size_t readers = std::min(static_cast<std::size_t>(options.readers), impl_->indices.size());
  for (std::size_t i = 0; i < readers; ++i)
    impl_->readers.emplace_back([impl = impl_.get()](const std::stop_token& stop) { impl->read_all(stop); });
}

FramePrefetcher::~FramePrefetcher() {
  for (std::jthread& reader : impl_->readers) reader.request_stop();  // all, before one of them is waited for
}

std::optional<Result<RgbdFrame>> FramePrefetcher::next() {
  std::unique_lock lock(impl_->mutex);
  if (impl_->taken == impl_->indices.size()) return std::nullopt;
  impl_->changed.wait(
      lock, [&] { return impl_->failure || (!impl_->begun.empty() && impl_->begun.front().has_value()); });
  if (impl_->failure) std::rethrow_exception(impl_->failure);
  auto frame = std::move(impl_->begun.front());
  impl_->begun.pop_front();
  ++impl_->taken;
  impl_->changed.notify_all();
  return frame;
}

}  // namespace hm
