#include <condition_variable>
#include <deque>
#include <mutex>
#include <stop_token>
#include <thread>

#include "hm/io/rgbd/recording.hpp"

namespace hm {

struct FramePrefetcher::Impl {
  std::mutex mutex;
  std::condition_variable_any changed;
  std::deque<Result<RgbdFrame>> ready;
  bool finished = false;
  std::jthread reader;  // last: stops before the other members are destroyed

  void read_all(const std::stop_token& stop, const FrameSource& frames,
                const std::vector<std::size_t>& indices, std::size_t ahead);
};

void FramePrefetcher::Impl::read_all(const std::stop_token& stop, const FrameSource& frames,
                                     const std::vector<std::size_t>& indices, std::size_t ahead) {
  for (const std::size_t index : indices) {
    {
      // Waits for room before decoding, so that at most `ahead` frames are held.
      std::unique_lock lock(mutex);
      if (!changed.wait(lock, stop, [&] { return ready.size() < ahead; })) return;
    }
    auto frame = frames.read(index);
    const std::scoped_lock lock(mutex);
    ready.push_back(std::move(frame));
    changed.notify_all();
  }
  const std::scoped_lock lock(mutex);
  finished = true;
  changed.notify_all();
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
                                 std::size_t stride, std::size_t ahead)
    : FramePrefetcher(recording, every(stride, begin, std::min(end, recording.info().frame_count)), ahead) {}

FramePrefetcher::FramePrefetcher(const FrameSource& frames, std::vector<std::size_t> indices,
                                 std::size_t ahead)
    : impl_(std::make_unique<Impl>()) {
  HM_CHECK(ahead >= 1, "ahead = {}", ahead);
  impl_->reader =
      std::jthread([impl = impl_.get(), &frames, indices = std::move(indices),
                    ahead](const std::stop_token& stop) { impl->read_all(stop, frames, indices, ahead); });
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
