#include "hm/cameras/video_device.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

namespace hm {
namespace {

class KernelVideoDevice : public VideoDevice {
 public:
  KernelVideoDevice(int descriptor, std::string path) : descriptor_(descriptor), path_(std::move(path)) {}
  ~KernelVideoDevice() override {
    for (const std::span<std::byte> bytes : mapped_) ::munmap(bytes.data(), bytes.size());
    ::close(descriptor_);
  }
  KernelVideoDevice(const KernelVideoDevice&) = delete;
  KernelVideoDevice& operator=(const KernelVideoDevice&) = delete;

  int control(unsigned long request, void* argument) override {
    int result = 0;
    do {
      result = ::ioctl(descriptor_, request, argument);
    } while (result < 0 && errno == EINTR);
    return result;
  }
  long read(std::span<std::byte> bytes) override { return ::read(descriptor_, bytes.data(), bytes.size()); }
  std::span<const std::byte> map(std::size_t length, std::size_t offset) override {
    void* address =
        ::mmap(nullptr, length, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor_, static_cast<off_t>(offset));
    if (address == MAP_FAILED) return {};
    mapped_.emplace_back(static_cast<std::byte*>(address), length);
    return mapped_.back();
  }
  [[nodiscard]] int descriptor() const override { return descriptor_; }
  [[nodiscard]] std::string name() const override { return path_; }

 private:
  int descriptor_;
  std::string path_;
  std::vector<std::span<std::byte>> mapped_;
};

}  // namespace

Result<std::unique_ptr<VideoDevice>> open_video_device(const std::string& path) {
  const int descriptor = ::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (descriptor < 0)
    return fail(errno == ENOENT ? ErrorCode::kNotFound : ErrorCode::kUnreadable, path, "cannot be opened: {}",
                std::strerror(errno));
  return std::make_unique<KernelVideoDevice>(descriptor, path);
}

std::vector<std::string> video_device_paths() {
  constexpr int kMostDevices = 64;
  std::vector<std::string> paths;
  std::error_code code;
  for (int i = 0; i < kMostDevices; ++i)
    if (std::string path = "/dev/video" + std::to_string(i); std::filesystem::exists(path, code))
      paths.push_back(std::move(path));
  return paths;
}

VideoInput wait_for_input(const VideoDevice& first, const VideoDevice& second,
                          std::chrono::milliseconds timeout) {
  std::array<pollfd, 2> polled{{{first.descriptor(), POLLIN, 0}, {second.descriptor(), POLLIN, 0}}};
  if (::poll(polled.data(), polled.size(), static_cast<int>(timeout.count())) <= 0) return {};
  return {polled[0].revents != 0, polled[1].revents != 0};
}

}  // namespace hm
