#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hm/cameras/video_device.hpp"
#include "hm/core/time.hpp"

namespace hm {

/// Image format of a stream, as negotiated with the device.
struct VideoFormat {
  std::uint32_t pixel_format = 0;  ///< V4L2_PIX_FMT_...
  int width = 0, height = 0;
  std::size_t row_bytes = 0, image_bytes = 0;
};

/// Stream of images of one V4L2 device, by mmap() buffers or by read().
class VideoStream {
 public:
  /// Starts the stream with the first of these pixel formats that the device has, at a size near `wanted` and
  /// `rate_hz`. Error: it has none of them, or refuses.
  static Result<VideoStream> start(std::unique_ptr<VideoDevice> device,
                                   std::span<const std::uint32_t> pixel_formats, const VideoFormat& wanted,
                                   double rate_hz);
  ~VideoStream();
  VideoStream(VideoStream&&) noexcept = default;
  VideoStream& operator=(VideoStream&&) = delete;

  [[nodiscard]] const VideoFormat& format() const { return format_; }
  [[nodiscard]] const VideoDevice& device() const { return *device_; }
  [[nodiscard]] std::string card() const { return card_; }

  /// One image, valid until the next call.
  struct Picture {
    std::span<const std::byte> bytes;  ///< compressed: as long as it is; else `image_bytes`, unless damaged
    Duration stamp;                    ///< monotonic clock
    bool is_damaged = false;           ///< the device says so, or it is too short
  };
  /// The image that is there; nothing if it is not complete yet. Error: the device is gone.
  Result<std::optional<Picture>> take();
  /// Sets a control (V4L2_CID_...) to a value; false if the device does not have it, or refuses.
  bool set_control(std::uint32_t id, std::int32_t value);
  /// The value of a control, if the device has it.
  std::optional<std::int32_t> control(std::uint32_t id);

 private:
  explicit VideoStream(std::unique_ptr<VideoDevice> device) : device_(std::move(device)) {}
  Result<void> negotiate(std::span<const std::uint32_t> pixel_formats, const VideoFormat& wanted,
                         double rate_hz);
  Result<void> begin();
  Result<std::optional<Picture>> read_picture();
  Result<std::optional<Picture>> take_buffer();
  [[nodiscard]] tl::unexpected<Error> device_error(const char* what) const;

  std::unique_ptr<VideoDevice> device_;
  std::string card_;
  VideoFormat format_;
  bool can_read_ = false, can_map_ = false, is_streaming_ = false;
  std::vector<std::span<const std::byte>> buffers_;
  std::optional<std::uint32_t> held_;  ///< buffer of the last picture, to be given back
  std::vector<std::byte> partial_;     ///< of read(): a picture that is not complete yet
  std::size_t partial_bytes_ = 0;
};

}  // namespace hm
