#pragma once
#include <chrono>
#include <deque>
#include <functional>
#include <optional>

#include "hm/cameras/camera_driver.hpp"
#include "hm/core/time.hpp"
#include "hm/sensors/rgbd_frame.hpp"

namespace hm {

/// Pairs depth images with the colour images nearest in time, for devices that deliver them one by one. Every
/// colour image is used once at most; holds a few images of each.
class FramePairing {
 public:
  /// `max_difference`: between the stamps of a pair; half the time between two images.
  explicit FramePairing(Duration max_difference) : max_difference_(max_difference) {}

  /// Adds an image; stamps of a kind increase, others are taken as they come.
  void add_depth(Time stamp, DepthImage depth) { depths_.push_back({stamp, std::move(depth)}); }
  void add_color(Time stamp, Image<Rgb8> color);
  /// The oldest depth image whose nearest colour image is known, with it; without colour where none is near
  /// enough. Nothing while a better colour image may still come.
  std::optional<RgbdFrame> take();

 private:
  template <class Kind>
  struct Stamped {
    Time stamp;
    Kind image;
  };
  Duration max_difference_;
  std::deque<Stamped<DepthImage>> depths_;
  std::deque<Stamped<Image<Rgb8>>> colors_;
};

/// Device stamps on the clock of this computer: the first one is now, or after `after`, and differences are
/// the device's.
class DeviceClock {
 public:
  explicit DeviceClock(std::optional<Time> after = {}) : after_(after) {}
  Time to_time(Duration since_device_start);

 private:
  std::optional<Time> after_;
  std::optional<Duration> offset_;
};

/// Depth and colour, which a device delivers one by one and stamps with the same clock.
struct DeviceFrames {
  DeviceFrames(double rate_hz, std::optional<Time> after)
      : clock(after), pairing(Duration::from_seconds(0.5 / rate_hz)) {}

  /// Waits up to so long for images of the device and adds them; an event that it returns comes before a
  /// frame.
  using AddImages = std::function<std::optional<CameraEvent>(std::chrono::milliseconds)>;
  /// The next pair, or kTimeout.
  CameraEvent next(std::chrono::milliseconds timeout, const AddImages& add_images);

  DeviceClock clock;
  FramePairing pairing;
};

}  // namespace hm
