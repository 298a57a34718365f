#include "hm/cameras/frame_pairing.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

namespace hm {
namespace {

/// Images that wait for their partners: more only where the other kind has stopped coming.
constexpr std::size_t kMostWaiting = 4;

Duration distance(Time a, Time b) { return a < b ? b - a : a - b; }

}  // namespace

void FramePairing::add_color(Time stamp, Image<Rgb8> color) {
  colors_.push_back({stamp, std::move(color)});
  if (colors_.size() > kMostWaiting) colors_.pop_front();
}

std::optional<RgbdFrame> FramePairing::take() {
  if (depths_.empty()) return std::nullopt;
  Stamped<DepthImage>& depth = depths_.front();
  const bool is_decided = !colors_.empty() && colors_.back().stamp >= depth.stamp;
  if (!is_decided && depths_.size() < kMostWaiting) return std::nullopt;
  RgbdFrame frame;
  frame.stamp = frame.color_stamp = depth.stamp;
  frame.depth = std::move(depth.image);
  depths_.pop_front();
  const auto nearest = std::min_element(colors_.begin(), colors_.end(), [&](const auto& a, const auto& b) {
    return distance(a.stamp, frame.stamp) < distance(b.stamp, frame.stamp);
  });
  if (nearest == colors_.end() || distance(nearest->stamp, frame.stamp) > max_difference_) return frame;
  frame.color_stamp = nearest->stamp;
  frame.color = std::move(nearest->image);
  colors_.erase(colors_.begin(), nearest + 1);
  return frame;
}

CameraEvent DeviceFrames::next(std::chrono::milliseconds timeout, const AddImages& add_images) {
  const auto until = std::chrono::steady_clock::now() + timeout;
  while (true) {
    if (auto frame = pairing.take()) return {CameraEvent::Kind::kFrame, std::move(*frame), {}};
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - std::chrono::steady_clock::now());
    if (left.count() <= 0) return {};
    if (auto event = add_images(left)) return std::move(*event);
  }
}

Time DeviceClock::to_time(Duration since_device_start) {
  if (!offset_) {
    constexpr Duration kGap{1'000'000};
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    Time first{std::chrono::duration_cast<std::chrono::nanoseconds>(now).count()};
    if (after_) first = std::max(first, *after_ + kGap);
    offset_ = first - Time{since_device_start.ns};
  }
  return Time{since_device_start.ns} + *offset_;
}

}  // namespace hm
