#pragma once
#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "hm/cameras/video_device.hpp"

namespace hm::testing_frames {

/// A video device without a kernel: answers V4L2's requests as its drivers do, and gives what it is fed, by
/// read() through a pipe or by buffers.
class FakeVideoDevice : public VideoDevice {
 public:
  struct Setup {
    std::uint32_t pixel_format = 0;
    int width = 0, height = 0;
    std::size_t row_bytes = 0, image_bytes = 0;
    bool by_read = false;
  };
  /// Part of a device that the test keeps while the driver owns it.
  struct Feed {
    /// Buffers: one image. By read(): bytes into the pipe, blocking where it is full.
    void give(const std::vector<std::byte>& bytes, std::int64_t stamp_us, bool is_damaged = false);
    /// No more images: the device is gone.
    void unplug();

    std::mutex mutex;
    struct Picture {
      std::vector<std::byte> bytes;
      std::int64_t stamp_us;
      bool is_damaged;
    };
    std::deque<Picture> waiting;
    bool is_gone = false;
    int to_device = -1, from_test = -1;  ///< the two ends of a pipe, or of an event counter
    bool by_read = false;
    std::map<std::uint32_t, std::int32_t> controls;
    std::set<std::uint32_t> queued;
    bool is_streaming = false;
    Feed() = default;
    Feed(const Feed&) = delete;
    Feed& operator=(const Feed&) = delete;
    ~Feed();
  };

  FakeVideoDevice(const Setup& setup, std::shared_ptr<Feed> feed);
  int control(unsigned long request, void* argument) override;
  long read(std::span<std::byte> bytes) override;
  std::span<const std::byte> map(std::size_t length, std::size_t offset) override;
  [[nodiscard]] int descriptor() const override { return feed_->from_test; }
  [[nodiscard]] std::string name() const override { return "fake"; }

 private:
  int dequeue(void* argument);

  Setup setup_;
  std::shared_ptr<Feed> feed_;
  std::vector<std::vector<std::byte>> buffers_;
};

}  // namespace hm::testing_frames
