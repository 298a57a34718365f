// hm: compiled alone, for the macros of V4L2
#include "hm/cameras/video_stream.hpp"

#include <fmt/format.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <utility>

namespace hm {
namespace {

constexpr std::uint32_t kBuffers = 4;

bool is_compressed(std::uint32_t pixel_format) { return pixel_format == V4L2_PIX_FMT_MJPEG; }

std::string four_letters(std::uint32_t code) {
  std::string text;
  for (int shift = 0; shift < 32; shift += 8) text += static_cast<char>((code >> shift) & 0x7f);
  while (text.ends_with(' ')) text.pop_back();
  return text;
}

/// Pixel formats of a device, as it lists them.
std::vector<std::uint32_t> formats_of(VideoDevice& device) {
  std::vector<std::uint32_t> formats;
  for (std::uint32_t i = 0;; ++i) {
    v4l2_fmtdesc description{};
    description.index = i;
    description.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (device.control(VIDIOC_ENUM_FMT, &description) != 0) return formats;
    formats.push_back(description.pixelformat);
  }
}

Duration now_monotonic() {
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  return {std::chrono::duration_cast<std::chrono::nanoseconds>(now).count()};
}

}  // namespace

tl::unexpected<Error> VideoStream::device_error(const char* what) const {
  return fail(errno == ENODEV || errno == EIO ? ErrorCode::kNotFound : ErrorCode::kUnreadable,
              device_->name(), "{}: {}", what, std::strerror(errno));
}

Result<VideoStream> VideoStream::start(std::unique_ptr<VideoDevice> device,
                                       std::span<const std::uint32_t> pixel_formats,
                                       const VideoFormat& wanted, double rate_hz) {
  VideoStream stream(std::move(device));
  if (const auto made = stream.negotiate(pixel_formats, wanted, rate_hz); !made) return forward_error(made);
  if (const auto begun = stream.begin(); !begun) return forward_error(begun);
  return stream;
}

Result<void> VideoStream::negotiate(std::span<const std::uint32_t> pixel_formats, const VideoFormat& wanted,
                                    double rate_hz) {
  v4l2_capability capability{};
  if (device_->control(VIDIOC_QUERYCAP, &capability) != 0) return device_error("is not a video device");
  const std::uint32_t can = (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? capability.device_caps
                                                                                  : capability.capabilities;
  can_read_ = (can & V4L2_CAP_READWRITE) != 0;
  can_map_ = (can & V4L2_CAP_STREAMING) != 0;
  card_.assign(reinterpret_cast<const char*>(capability.card),
               ::strnlen(reinterpret_cast<const char*>(capability.card), sizeof capability.card));
  const std::vector<std::uint32_t> has = formats_of(*device_);
  const auto chosen = std::find_if(pixel_formats.begin(), pixel_formats.end(), [&](std::uint32_t format) {
    return std::find(has.begin(), has.end(), format) != has.end();
  });
  if (chosen == pixel_formats.end())
    return fail(ErrorCode::kUnsupported, device_->name(), "does not give {} images",
                four_letters(pixel_formats.front()));
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  format.fmt.pix.width = static_cast<std::uint32_t>(wanted.width);
  format.fmt.pix.height = static_cast<std::uint32_t>(wanted.height);
  format.fmt.pix.pixelformat = *chosen;
  format.fmt.pix.field = V4L2_FIELD_NONE;
  if (device_->control(VIDIOC_S_FMT, &format) != 0) return device_error("the image format is refused");
  const v4l2_pix_format& pix = format.fmt.pix;
  constexpr std::uint32_t kMostEdge = 8192;
  if (pix.pixelformat != *chosen || pix.width == 0 || pix.height == 0 || pix.width > kMostEdge ||
      pix.height > kMostEdge || pix.width % 2 != 0)
    return fail(ErrorCode::kUnsupported, device_->name(), "gives {} images of {} x {} instead",
                four_letters(pix.pixelformat), pix.width, pix.height);
  const std::size_t least_row = is_compressed(*chosen) ? 0 : 2 * std::size_t{pix.width};
  format_ = {*chosen, static_cast<int>(pix.width), static_cast<int>(pix.height),
             std::max<std::size_t>(pix.bytesperline, least_row), pix.sizeimage};
  if (!is_compressed(*chosen))
    format_.image_bytes = std::max(format_.image_bytes, format_.row_bytes * pix.height);
  v4l2_streamparm parameters{};
  parameters.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  parameters.parm.capture.timeperframe = {1, static_cast<std::uint32_t>(std::lround(rate_hz))};
  device_->control(VIDIOC_S_PARM, &parameters);  // a device that cannot keeps its own rate
  return {};
}

Result<void> VideoStream::begin() {
  if (!can_map_) {
    if (can_read_) return {};
    return fail(ErrorCode::kUnsupported, device_->name(), "gives images neither by mmap() nor by read()");
  }
  v4l2_requestbuffers request{};
  request.count = kBuffers;
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  if (device_->control(VIDIOC_REQBUFS, &request) != 0) return device_error("gives no buffers");
  for (std::uint32_t i = 0; i < request.count; ++i) {
    v4l2_buffer buffer{};
    buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    buffer.memory = V4L2_MEMORY_MMAP;
    buffer.index = i;
    if (device_->control(VIDIOC_QUERYBUF, &buffer) != 0) return device_error("a buffer is refused");
    buffers_.push_back(device_->map(buffer.length, buffer.m.offset));
    if (buffers_.back().empty()) return device_error("a buffer cannot be mapped");
    if (device_->control(VIDIOC_QBUF, &buffer) != 0) return device_error("a buffer is refused");
  }
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (device_->control(VIDIOC_STREAMON, &type) != 0) return device_error("the stream does not start");
  is_streaming_ = true;
  return {};
}

VideoStream::~VideoStream() {
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (device_ && is_streaming_) device_->control(VIDIOC_STREAMOFF, &type);
}

Result<std::optional<VideoStream::Picture>> VideoStream::take() {
  return can_map_ ? take_buffer() : read_picture();
}

Result<std::optional<VideoStream::Picture>> VideoStream::take_buffer() {
  v4l2_buffer buffer{};
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  if (held_) {
    buffer.index = *std::exchange(held_, std::nullopt);
    if (device_->control(VIDIOC_QBUF, &buffer) != 0) return device_error("the device is gone");
  }
  if (device_->control(VIDIOC_DQBUF, &buffer) != 0) {
    if (errno == EAGAIN) return std::nullopt;
    return device_error("the device is gone");
  }
  if (buffer.index >= buffers_.size())
    return fail(ErrorCode::kCorrupted, device_->name(), "gives buffer {} of {}", buffer.index,
                buffers_.size());
  held_ = buffer.index;
  const std::span<const std::byte> whole = buffers_[buffer.index];
  Picture picture;
  picture.bytes = whole.first(std::min<std::size_t>(buffer.bytesused, whole.size()));
  picture.stamp = {std::int64_t{buffer.timestamp.tv_sec} * 1'000'000'000 +
                   std::int64_t{buffer.timestamp.tv_usec} * 1'000};
  picture.is_damaged = (buffer.flags & V4L2_BUF_FLAG_ERROR) != 0;
  return picture;
}

/// read() gives one image at a time, or a part of one where it comes through a pipe.
Result<std::optional<VideoStream::Picture>> VideoStream::read_picture() {
  partial_.resize(format_.image_bytes);
  const long count = device_->read(std::span(partial_).subspan(partial_bytes_));
  if (count < 0 && (errno == EAGAIN || errno == EINTR)) return std::nullopt;
  if (count < 0) return device_error("the device is gone");
  if (count == 0)
    return fail(ErrorCode::kNotFound, device_->name(), "the device is gone: no more images{}",
                partial_bytes_ > 0 ? fmt::format(", the last one ended after {} of {} bytes", partial_bytes_,
                                                 partial_.size())
                                   : "");
  partial_bytes_ += static_cast<std::size_t>(count);
  if (partial_bytes_ < partial_.size() && !is_compressed(format_.pixel_format)) return std::nullopt;
  Picture picture;
  picture.bytes = std::span(partial_).first(std::exchange(partial_bytes_, 0));
  picture.stamp = now_monotonic();
  return picture;
}

bool VideoStream::set_control(std::uint32_t id, std::int32_t value) {
  v4l2_control control{id, value};
  return device_->control(VIDIOC_S_CTRL, &control) == 0;
}

std::optional<std::int32_t> VideoStream::control(std::uint32_t id) {
  v4l2_control control{id, 0};
  if (device_->control(VIDIOC_G_CTRL, &control) != 0) return std::nullopt;
  return control.value;
}

}  // namespace hm
