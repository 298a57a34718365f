#include <condition_variable>
#include <deque>
#include <mutex>
#include <stop_token>
#include <thread>

#include "hm/io/recording.hpp"

namespace hm {

struct FramePrefetcher::Impl {
  std::mutex mutex;
  std::condition_variable_any changed;
  std::deque<Result<RgbdFrame>> ready;
  bool finished = false;
  std::jthread reader;  // last: it stops before the rest goes

  void read_all(const std::stop_token& stop, const Recording& recording, std::size_t begin, std::size_t end,
                std::size_t stride, std::size_t ahead);
};

void FramePrefetcher::Impl::read_all(const std::stop_token& stop, const Recording& recording,
                                     std::size_t begin, std::size_t end, std::size_t stride,
                                     std::size_t ahead) {
  for (std::size_t i = begin; i < end; i += std::min(stride, end - i)) {
    {
      // Room first, then decoding: so that never more than `ahead` frames are held.
      std::unique_lock lock(mutex);
      if (!changed.wait(lock, stop, [&] { return ready.size() < ahead; })) return;
    }
    auto frame = recording.read(i);
    const std::scoped_lock lock(mutex);
    ready.push_back(std::move(frame));
    changed.notify_all();
  }
  const std::scoped_lock lock(mutex);
  finished = true;
  changed.notify_all();
}

FramePrefetcher::FramePrefetcher(const Recording& recording, std::size_t begin, std::size_t end,
                                 std::size_t stride, std::size_t ahead)
    : impl_(std::make_unique<Impl>()) {
  HM_CHECK(stride >= 1 && ahead >= 1, "stride = {}, ahead = {}", stride, ahead);
  end = std::min(end, recording.info().frame_count);
  impl_->reader =
      std::jthread([impl = impl_.get(), &recording, begin, end, stride, ahead](const std::stop_token& stop) {
        impl->read_all(stop, recording, begin, end, stride, ahead);
      });
}

FramePrefetcher::~FramePrefetcher() = default;

std::optional<Result<RgbdFrame>> FramePrefetcher::next() {
  std::unique_lock lock(impl_->mutex);
  impl_->changed.wait(lock, [&] { return !impl_->ready.empty() || impl_->finished; });
  if (impl_->ready.empty()) return std::nullopt;
  std::optional<Result<RgbdFrame>> frame(std::move(impl_->ready.front()));
  impl_->ready.pop_front();
  impl_->changed.notify_all();
  return frame;
}

}  // namespace hm
