#pragma once
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "hm/link/transport/file_descriptor.hpp"
#include "hm/link/transport/transport.hpp"

namespace hm {

/// Baud rates that POSIX and Linux know by name, in increasing order.
[[nodiscard]] std::span<const int> serial_baud_rates();

/// A serial port: 8 data bits, no parity, 1 stop bit, no flow control, raw. When the device is unplugged it
/// is closed; each read() or write() then tries to open it again, at most every kRetry.
class SerialPort : public Transport {
 public:
  static constexpr std::chrono::milliseconds kRetry{200};

  /// Errors: kUsage for a baud rate that is not in serial_baud_rates(); kNotFound, kUnreadable when the
  /// device cannot be opened now; kUnsupported when it is no serial port.
  static Result<std::unique_ptr<SerialPort>> open(const std::string& path, int baud);

  std::size_t read(std::span<std::uint8_t> buffer) override;
  bool write(std::span<const std::uint8_t> bytes) override;
  bool wait(Duration limit) override;
  [[nodiscard]] bool is_datagram() const override { return false; }
  [[nodiscard]] bool is_open() const override { return descriptor_.is_open(); }
  [[nodiscard]] std::string name() const override;
  /// How often the device was opened again after it was gone.
  [[nodiscard]] int reconnections() const { return reconnections_; }

 private:
  SerialPort(std::string path, int baud) : path_(std::move(path)), baud_(baud) {}
  Result<void> open_device();
  bool reopen_if_due();
  std::optional<std::size_t> write_some(std::span<const std::uint8_t> bytes);

  std::string path_;
  int baud_;
  FileDescriptor descriptor_;
  std::chrono::steady_clock::time_point last_try_;
  int reconnections_ = 0;
  std::vector<std::uint8_t> unsent_;
};

}  // namespace hm
