#include "hm/cameras/live_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <numeric>
#include <stop_token>
#include <thread>
#include <utility>

namespace hm {
namespace {

using Clock = std::chrono::steady_clock;
/// How often the thread looks whether it should stop.
constexpr std::chrono::milliseconds kPoll{100};

}  // namespace

std::string_view to_string(DropReason reason) {
  constexpr std::array<std::string_view, kDropReasons> kNames{
      "queue_full", "incomplete", "no_color", "wrong_size", "stamp_not_increasing", "no_depth"};
  return kNames[static_cast<std::size_t>(reason)];
}

std::size_t CaptureCounts::dropped_in_all() const {
  return std::accumulate(dropped.begin(), dropped.end(), std::size_t{0});
}

struct LiveSource::Impl {
  Impl(std::unique_ptr<CameraDriver> driver, const LiveSourceOptions& how, Tap sink)
      : camera(std::move(driver)), options(how), tap(std::move(sink)), size(camera->describe().camera) {}

  std::unique_ptr<CameraDriver> camera;
  LiveSourceOptions options;
  Tap tap;
  PinholeCamera size;
  std::optional<Time> last_stamp, last_color_stamp;  // of the reading thread
  mutable std::mutex mutex;
  std::condition_variable changed;
  std::deque<CapturedFrame> queue;
  CaptureCounts counts;
  CaptureEnd end = CaptureEnd::kRunning;
  std::string end_reason;
  Clock::time_point ended_at;
  std::jthread thread;  // last: ends before the rest

  void read(const std::stop_token& stop);
  [[nodiscard]] std::optional<DropReason> reason_to_drop(const RgbdFrame& frame) const;
  void take(RgbdFrame frame);
  void drop(DropReason reason, const std::string& why = {});
  void finish(CaptureEnd how, std::string reason);
};

std::optional<DropReason> LiveSource::Impl::reason_to_drop(const RgbdFrame& frame) const {
  const auto fits = [this](const auto& image) {
    return image.width() == size.width && image.height() == size.height;
  };
  if (!fits(frame.depth)) return DropReason::kWrongSize;
  if (frame.color.empty()) return DropReason::kNoColor;
  if (!fits(frame.color)) return DropReason::kWrongSize;
  if ((last_stamp && frame.stamp <= *last_stamp) ||
      (last_color_stamp && frame.color_stamp <= *last_color_stamp))
    return DropReason::kStampNotIncreasing;
  const auto depths = frame.depth.units.pixels();
  if (std::all_of(depths.begin(), depths.end(), [](std::uint16_t depth) { return depth == 0; }))
    return DropReason::kNoDepth;
  return std::nullopt;
}

void LiveSource::Impl::drop(DropReason reason, const std::string& why) {
  const std::scoped_lock lock(mutex);
  ++counts.captured;
  ++counts.dropped[static_cast<std::size_t>(reason)];
  if (reason == DropReason::kIncomplete && counts.first_incomplete.empty()) counts.first_incomplete = why;
}

void LiveSource::Impl::take(RgbdFrame frame) {
  const auto received = Clock::now();
  if (const auto reason = reason_to_drop(frame)) return drop(*reason);
  last_stamp = frame.stamp;
  last_color_stamp = frame.color_stamp;
  const auto shared = std::make_shared<const RgbdFrame>(std::move(frame));
  if (tap) tap(shared);
  const std::scoped_lock lock(mutex);
  ++counts.captured;
  queue.push_back({shared, received});
  if (queue.size() > options.queue_frames) {
    queue.pop_front();
    ++counts.dropped[static_cast<std::size_t>(DropReason::kQueueFull)];
  }
  changed.notify_all();
}

void LiveSource::Impl::finish(CaptureEnd how, std::string reason) {
  const std::scoped_lock lock(mutex);
  end = how;
  end_reason = std::move(reason);
  ended_at = Clock::now();
  changed.notify_all();
}

void LiveSource::Impl::read(const std::stop_token& stop) {
  auto last_heard = Clock::now();
  while (!stop.stop_requested()) {
    CameraEvent event = camera->next(kPoll);
    const auto now = Clock::now();
    if (event.kind == CameraEvent::Kind::kTimeout && now - last_heard > options.silence)
      return finish(CaptureEnd::kFailed,
                    fmt::format("the camera has given no image for {} s",
                                std::chrono::duration_cast<std::chrono::seconds>(options.silence).count()));
    if (event.kind != CameraEvent::Kind::kTimeout) last_heard = now;
    if (event.kind == CameraEvent::Kind::kFrame) take(std::move(event.frame));
    if (event.kind == CameraEvent::Kind::kIncomplete) drop(DropReason::kIncomplete, event.reason);
    if (event.kind == CameraEvent::Kind::kEnd) return finish(CaptureEnd::kFinished, std::move(event.reason));
    if (event.kind == CameraEvent::Kind::kFailed) return finish(CaptureEnd::kFailed, std::move(event.reason));
  }
  finish(CaptureEnd::kStopped, "stopped");
}

LiveSource::LiveSource(std::unique_ptr<CameraDriver> camera, const LiveSourceOptions& options, Tap tap)
    : impl_(std::make_unique<Impl>(std::move(camera), options, std::move(tap))) {
  HM_CHECK(options.queue_frames >= 1, "queue_frames = {}", options.queue_frames);
  impl_->thread = std::jthread([impl = impl_.get()](const std::stop_token& stop) { impl->read(stop); });
}

LiveSource::~LiveSource() = default;

std::optional<CapturedFrame> LiveSource::next(std::chrono::milliseconds wait) {
  std::unique_lock lock(impl_->mutex);
  impl_->changed.wait_for(lock, wait,
                          [&] { return !impl_->queue.empty() || impl_->end != CaptureEnd::kRunning; });
  if (impl_->queue.empty()) return std::nullopt;
  CapturedFrame frame = std::move(impl_->queue.front());
  impl_->queue.pop_front();
  ++impl_->counts.taken;
  return frame;
}

void LiveSource::stop() {
  impl_->thread.request_stop();
  if (impl_->thread.joinable()) impl_->thread.join();
}

CaptureEnd LiveSource::end() const {
  const std::scoped_lock lock(impl_->mutex);
  return impl_->queue.empty() ? impl_->end : CaptureEnd::kRunning;
}

std::string LiveSource::end_reason() const {
  const std::scoped_lock lock(impl_->mutex);
  return impl_->end_reason;
}

Clock::time_point LiveSource::ended_at() const {
  const std::scoped_lock lock(impl_->mutex);
  return impl_->ended_at;
}

CaptureCounts LiveSource::counts() const {
  const std::scoped_lock lock(impl_->mutex);
  CaptureCounts counts = impl_->counts;
  counts.waiting = impl_->queue.size();
  return counts;
}

}  // namespace hm
