#include "hm/cameras/testing/fake_video_device.hpp"

#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "hm/core/check.hpp"

namespace hm::testing_frames {
namespace {

int refuse(int number) {
  errno = number;
  return -1;
}

}  // namespace

FakeVideoDevice::Feed::~Feed() {
  if (to_device >= 0 && to_device != from_test) ::close(to_device);
  if (from_test >= 0) ::close(from_test);
}

void FakeVideoDevice::Feed::give(const std::vector<std::byte>& bytes, std::int64_t stamp_us,
                                 bool is_damaged) {
  if (by_read) {
    for (std::size_t done = 0; done < bytes.size();) {
      const ssize_t count = ::write(to_device, bytes.data() + done, bytes.size() - done);
      HM_CHECK(count > 0, "{}", std::strerror(errno));
      done += static_cast<std::size_t>(count);
    }
    return;
  }
  const std::scoped_lock lock(mutex);
  waiting.push_back({bytes, stamp_us, is_damaged});
  HM_CHECK(::eventfd_write(to_device, 1) == 0);
}

void FakeVideoDevice::Feed::unplug() {
  const std::scoped_lock lock(mutex);
  is_gone = true;
  if (by_read) {
    ::close(std::exchange(to_device, -1));
  } else {
    HM_CHECK(::eventfd_write(to_device, 1) == 0);
  }
}

FakeVideoDevice::FakeVideoDevice(const Setup& setup, std::shared_ptr<Feed> feed)
    : setup_(setup), feed_(std::move(feed)) {
  feed_->by_read = setup.by_read;
  if (setup.by_read) {
    std::array<int, 2> ends{};
    HM_CHECK(::pipe(ends.data()) == 0);
    feed_->from_test = ends[0], feed_->to_device = ends[1];
    HM_CHECK(::fcntl(ends[0], F_SETFL, O_NONBLOCK) == 0);
  } else {
    feed_->to_device = feed_->from_test = ::eventfd(0, EFD_SEMAPHORE | EFD_NONBLOCK);
  }
}

int FakeVideoDevice::control(unsigned long request, void* argument) {
  const std::scoped_lock lock(feed_->mutex);
  switch (request) {
    case VIDIOC_QUERYCAP: {
      auto& answer = *static_cast<v4l2_capability*>(argument);
      std::strcpy(reinterpret_cast<char*>(answer.card), "fake camera");
      answer.device_caps = setup_.by_read ? V4L2_CAP_READWRITE : V4L2_CAP_STREAMING;
      answer.capabilities = V4L2_CAP_DEVICE_CAPS | V4L2_CAP_VIDEO_CAPTURE;
      return 0;
    }
    case VIDIOC_ENUM_FMT: {
      auto& answer = *static_cast<v4l2_fmtdesc*>(argument);
      if (answer.index > 0) return refuse(EINVAL);
      answer.pixelformat = setup_.pixel_format;
      return 0;
    }
    case VIDIOC_S_FMT: {
      auto& pix = static_cast<v4l2_format*>(argument)->fmt.pix;
      pix.width = static_cast<std::uint32_t>(setup_.width);
      pix.height = static_cast<std::uint32_t>(setup_.height);
      pix.bytesperline = static_cast<std::uint32_t>(setup_.row_bytes);
      pix.sizeimage = static_cast<std::uint32_t>(setup_.image_bytes);
      return 0;
    }
    case VIDIOC_REQBUFS: {
      auto& answer = *static_cast<v4l2_requestbuffers*>(argument);
      buffers_.assign(std::min(answer.count, 3U), std::vector<std::byte>(setup_.image_bytes));
      answer.count = static_cast<std::uint32_t>(buffers_.size());
      return 0;
    }
    case VIDIOC_QUERYBUF: {
      auto& answer = *static_cast<v4l2_buffer*>(argument);
      answer.length = static_cast<std::uint32_t>(setup_.image_bytes);
      answer.m.offset = answer.index;
      return 0;
    }
    case VIDIOC_QBUF:
      return feed_->queued.insert(static_cast<v4l2_buffer*>(argument)->index).second ? 0 : refuse(EINVAL);
    case VIDIOC_DQBUF:
      return dequeue(argument);
    case VIDIOC_STREAMON:
    case VIDIOC_STREAMOFF:
      feed_->is_streaming = request == VIDIOC_STREAMON;
      return 0;
    case VIDIOC_G_CTRL: {
      auto& control = *static_cast<v4l2_control*>(argument);
      const auto known = feed_->controls.find(control.id);
      if (known == feed_->controls.end()) return refuse(EINVAL);
      control.value = known->second;
      return 0;
    }
    case VIDIOC_S_CTRL: {
      const auto& control = *static_cast<const v4l2_control*>(argument);
      const auto known = feed_->controls.find(control.id);
      if (known == feed_->controls.end()) return refuse(EINVAL);
      known->second = control.value;
      return 0;
    }
    default:
      return refuse(ENOTTY);
  }
}

int FakeVideoDevice::dequeue(void* argument) {
  auto& buffer = *static_cast<v4l2_buffer*>(argument);
  if (feed_->waiting.empty()) return refuse(feed_->is_gone ? ENODEV : EAGAIN);
  if (feed_->queued.empty()) return refuse(EAGAIN);
  eventfd_t ignored = 0;
  HM_CHECK(::eventfd_read(feed_->from_test, &ignored) == 0);
  const Feed::Picture picture = std::move(feed_->waiting.front());
  feed_->waiting.pop_front();
  buffer.index = *feed_->queued.begin();
  feed_->queued.erase(feed_->queued.begin());
  std::copy(picture.bytes.begin(), picture.bytes.end(), buffers_[buffer.index].begin());
  buffer.bytesused = static_cast<std::uint32_t>(picture.bytes.size());
  buffer.timestamp.tv_sec = picture.stamp_us / 1'000'000;
  buffer.timestamp.tv_usec = picture.stamp_us % 1'000'000;
  if (picture.is_damaged) buffer.flags |= V4L2_BUF_FLAG_ERROR;
  return 0;
}

long FakeVideoDevice::read(std::span<std::byte> bytes) {
  return ::read(feed_->from_test, bytes.data(), bytes.size());
}

std::span<const std::byte> FakeVideoDevice::map(std::size_t length, std::size_t offset) {
  return std::span(buffers_.at(offset)).first(length);
}

}  // namespace hm::testing_frames
