#pragma once
#include <array>
#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "hm/cameras/camera_driver.hpp"

namespace hm {

/// Why a depth image of a camera does not reach the consumer of a LiveSource.
enum class DropReason {
  kQueueFull,           ///< the consumer was slower than the camera: the oldest waiting frame
  kIncomplete,          ///< the driver could not make an image of it
  kNoColor,             ///< no colour image belongs to it
  kWrongSize,           ///< an image is not of the camera's size
  kStampNotIncreasing,  ///< depth or colour not later than the frame before
  kNoDepth,             ///< not one reading
};
inline constexpr std::size_t kDropReasons = 6;
/// Key of a reason: "queue_full".
std::string_view to_string(DropReason reason);

/// Frames of a LiveSource, none of them uncounted: captured = taken + waiting + all dropped.
struct CaptureCounts {
  std::size_t captured = 0;  ///< depth images that the camera gave
  std::size_t taken = 0;     ///< by next()
  std::size_t waiting = 0;   ///< in the queue
  std::array<std::size_t, kDropReasons> dropped{};
  std::string first_incomplete;  ///< why the first incomplete image was
  [[nodiscard]] std::size_t dropped_for(DropReason reason) const {
    return dropped[static_cast<std::size_t>(reason)];
  }
  [[nodiscard]] std::size_t dropped_in_all() const;
};

/// How a LiveSource came to its end.
enum class CaptureEnd {
  kRunning,
  kStopped,   ///< by stop()
  kFinished,  ///< no more frames, as it should be
  kFailed,    ///< unplugged, or an error
};

/// A frame with the moment at which the computer had it.
struct CapturedFrame {
  std::shared_ptr<const RgbdFrame> frame;
  std::chrono::steady_clock::time_point received;
};

struct LiveSourceOptions {
  std::size_t queue_frames = 2;              ///< that wait for the consumer, at most
  std::chrono::milliseconds silence{5'000};  ///< a camera that gives nothing for so long has failed
};

/// Reads a camera on a thread of its own, checks its frames, and hands them to one consumer; the newest wins:
/// a full queue drops its oldest frame. Every frame that does not arrive is counted, by reason.
class LiveSource {
 public:
  /// Receives every usable frame, on the source's thread, before it may be dropped from the queue. Must
  /// return at once.
  using Tap = std::function<void(const std::shared_ptr<const RgbdFrame>&)>;

  LiveSource(std::unique_ptr<CameraDriver> camera, const LiveSourceOptions& options, Tap tap = {});
  /// Stops and waits for the driver's current next().
  ~LiveSource();
  LiveSource(const LiveSource&) = delete;
  LiveSource& operator=(const LiveSource&) = delete;

  /// The oldest frame that waits; waits up to `wait` for one. Nothing in time, or at the end: see end().
  std::optional<CapturedFrame> next(std::chrono::milliseconds wait);
  /// Ends the capture and waits for its thread; frames in the queue stay.
  void stop();
  /// How it ended; kRunning also while frames wait that were captured before the end.
  [[nodiscard]] CaptureEnd end() const;
  /// Reason of kFailed and kFinished, in words.
  [[nodiscard]] std::string end_reason() const;
  /// Moment of the end, to measure what follows it.
  [[nodiscard]] std::chrono::steady_clock::time_point ended_at() const;
  [[nodiscard]] CaptureCounts counts() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
