#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace hm {

/// CRC of 16 bits with the reflected polynomial 0x8408 (x^16 + x^12 + x^5 + 1), without a final inversion.
/// MAVLink starts it at 0xFFFF, the dissertation's serial protocol at 0x00FF. Finds every error of one or two
/// bits within 4 kB, and every burst of up to 16 bits.
class Crc16 {
 public:
  constexpr explicit Crc16(std::uint16_t start) : value_(start) {}
  constexpr void add(std::uint8_t byte) {
    auto low = static_cast<std::uint8_t>(byte ^ (value_ & 0xFFU));
    low = static_cast<std::uint8_t>(low ^ (low << 4U));
    const auto wide = static_cast<std::uint32_t>(low);
    value_ = static_cast<std::uint16_t>((value_ >> 8U) ^ (wide << 8U) ^ (wide << 3U) ^ (wide >> 4U));
  }
  constexpr void add(std::span<const std::uint8_t> bytes) {
    for (const std::uint8_t byte : bytes) add(byte);
  }
  constexpr void add(std::string_view text) {
    for (const char letter : text) add(static_cast<std::uint8_t>(letter));
  }
  [[nodiscard]] constexpr std::uint16_t value() const { return value_; }

 private:
  std::uint16_t value_;
};

}  // namespace hm
