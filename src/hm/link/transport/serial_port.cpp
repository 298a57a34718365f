#include "hm/link/transport/serial_port.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>
#include <thread>
#include <utility>

namespace hm {
namespace {

struct BaudRate {
  int baud;
  speed_t code;
};
constexpr std::array kBaudTable{
    BaudRate{9600, B9600},       BaudRate{19200, B19200},     BaudRate{38400, B38400},
    BaudRate{57600, B57600},     BaudRate{115200, B115200},   BaudRate{230400, B230400},
#ifdef B460800
    BaudRate{460800, B460800},   BaudRate{500000, B500000},   BaudRate{921600, B921600},
    BaudRate{1000000, B1000000}, BaudRate{1500000, B1500000}, BaudRate{2000000, B2000000},
    BaudRate{3000000, B3000000}, BaudRate{4000000, B4000000},
#endif
};
constexpr auto kBauds = [] {
  std::array<int, kBaudTable.size()> bauds{};
  for (std::size_t i = 0; i < bauds.size(); ++i) bauds[i] = kBaudTable[i].baud;
  return bauds;
}();

/// Raw bytes at this speed; false if the descriptor is no terminal or does not know the speed.
bool make_raw(int descriptor, speed_t speed) {
  termios settings{};
  if (::tcgetattr(descriptor, &settings) != 0) return false;
  ::cfmakeraw(&settings);
  settings.c_cflag |= CLOCAL | CREAD;
  settings.c_cflag &= ~static_cast<tcflag_t>(CSTOPB | CRTSCTS);
  settings.c_cc[VMIN] = 0;
  settings.c_cc[VTIME] = 0;
  if (::cfsetispeed(&settings, speed) != 0 || ::cfsetospeed(&settings, speed) != 0) return false;
  return ::tcsetattr(descriptor, TCSANOW, &settings) == 0;
}

}  // namespace

std::span<const int> serial_baud_rates() { return kBauds; }

Result<std::unique_ptr<SerialPort>> SerialPort::open(const std::string& path, int baud) {
  if (std::ranges::find(kBauds, baud) == kBauds.end())
    return fail(ErrorCode::kUsage, path, "no baud rate {}; there are {}", baud, fmt::join(kBauds, ", "));
  std::unique_ptr<SerialPort> port(new SerialPort(path, baud));
  if (const auto opened = port->open_device(); !opened) return forward_error(opened);
  return port;
}

Result<void> SerialPort::open_device() {
  last_try_ = std::chrono::steady_clock::now();
  FileDescriptor descriptor(::open(path_.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!descriptor.is_open()) {
    const int number = errno;
    const ErrorCode code = number == ENOENT ? ErrorCode::kNotFound : ErrorCode::kUnreadable;
    return fail(code, path_, "cannot open the serial port: {}", std::generic_category().message(number));
  }
  const auto rate = std::ranges::find(kBaudTable, baud_, &BaudRate::baud);
  if (!make_raw(descriptor.get(), rate->code))
    return fail(ErrorCode::kUnsupported, path_, "is no serial port that can do {} baud", baud_);
  ::tcflush(descriptor.get(), TCIOFLUSH);
  descriptor_ = std::move(descriptor);
  return {};
}

bool SerialPort::reopen_if_due() {
  if (descriptor_.is_open()) return true;
  if (std::chrono::steady_clock::now() - last_try_ < kRetry) return false;
  if (!open_device()) return false;
  ++reconnections_;
  return true;
}

std::size_t SerialPort::read(std::span<std::uint8_t> buffer) {
  if (!reopen_if_due()) return 0;
  const ssize_t count = ::read(descriptor_.get(), buffer.data(), buffer.size());
  if (count > 0) return static_cast<std::size_t>(count);
  // Nothing there gives EAGAIN, or 0 (VMIN 0) on a port; with the device gone it is EIO, or 0 with a hang-up.
  const bool quiet = count < 0 && (errno == EAGAIN || errno == EINTR);
  if (!quiet && (count < 0 || descriptor_.has_hung_up())) descriptor_.reset();
  return 0;
}

/// Writes what there is room for; the count, or nothing if the device is gone.
std::optional<std::size_t> SerialPort::write_some(std::span<const std::uint8_t> bytes) {
  const ssize_t count = ::write(descriptor_.get(), bytes.data(), bytes.size());
  if (count >= 0) return static_cast<std::size_t>(count);
  if (errno == EAGAIN || errno == EINTR) return 0;
  descriptor_.reset();
  unsent_.clear();
  return std::nullopt;
}

bool SerialPort::write(std::span<const std::uint8_t> bytes) {
  if (!reopen_if_due()) return false;
  if (!unsent_.empty()) {
    const auto count = write_some(unsent_);
    if (!count) return false;
    unsent_.erase(unsent_.begin(), unsent_.begin() + static_cast<std::ptrdiff_t>(*count));
    if (!unsent_.empty()) return false;
  }
  const auto count = write_some(bytes);
  if (!count || (*count == 0 && !bytes.empty())) return false;
  // A frame that goes out in part would be noise at the other end: its rest goes first next time.
  unsent_.assign(bytes.begin() + static_cast<std::ptrdiff_t>(*count), bytes.end());
  return true;
}

bool SerialPort::wait(Duration limit) {
  if (descriptor_.is_open()) return descriptor_.wait_readable(limit);
  std::this_thread::sleep_for(std::min(std::chrono::nanoseconds(limit.ns), std::chrono::nanoseconds(kRetry)));
  return false;
}

std::string SerialPort::name() const { return fmt::format("{} at {} baud", path_, baud_); }

}  // namespace hm
