#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "hm/core/result.hpp"
#include "hm/core/time.hpp"

namespace hm {

/// A way for bytes that never waits, except in wait(). A way that breaks (unplugged, port not there yet) is
/// no error of a program that flies: reading gives nothing, writing loses what is written, and reopening is
/// tried again by itself.
class Transport {
 public:
  virtual ~Transport() = default;
  Transport() = default;
  Transport(const Transport&) = delete;
  Transport& operator=(const Transport&) = delete;

  /// Bytes that have arrived, at most `buffer.size()`; 0 if there are none. Of a datagram way one whole
  /// datagram, of which what exceeds the buffer is lost.
  virtual std::size_t read(std::span<std::uint8_t> buffer) = 0;
  /// Writes all or nothing; false if it could not (no room in the kernel, not connected, no peer known yet).
  virtual bool write(std::span<const std::uint8_t> bytes) = 0;
  /// Waits until bytes can be read, at most `limit`; false if none came.
  virtual bool wait(Duration limit) = 0;
  /// Whether each read() gives one datagram, so that a frame never spans two.
  [[nodiscard]] virtual bool is_datagram() const = 0;
  /// Whether the way is open at the moment.
  [[nodiscard]] virtual bool is_open() const = 0;
  /// Description for messages: "/dev/ttyACM0 at 921600 baud".
  [[nodiscard]] virtual std::string name() const = 0;
};

}  // namespace hm
