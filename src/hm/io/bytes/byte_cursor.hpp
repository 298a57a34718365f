#pragma once
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>

namespace hm::detail {

/// Reads little-endian values from bytes, front to back, never beyond their end: a read past it returns zero
/// or an empty value and makes ok() false for good.
class ByteCursor {
 public:
  explicit ByteCursor(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  [[nodiscard]] bool ok() const { return ok_; }
  [[nodiscard]] std::size_t remaining() const { return bytes_.size(); }

  /// Returns the next `count` bytes and advances.
  std::span<const std::uint8_t> take(std::size_t count) {
    if (!ok_ || count > bytes_.size()) {
      ok_ = false;
      return {};
    }
    const auto taken = bytes_.first(count);
    bytes_ = bytes_.subspan(count);
    return taken;
  }
  template <class T>
  T value() {
    static_assert(std::is_arithmetic_v<T>);
    T result{};
    const auto bytes = take(sizeof(T));
    if (ok_) std::memcpy(&result, bytes.data(), sizeof(T));
    return result;
  }
  /// Reads a 32-bit length followed by that many characters.
  std::string text() {
    const auto bytes = take(value<std::uint32_t>());
    return {bytes.begin(), bytes.end()};
  }

 private:
  std::span<const std::uint8_t> bytes_;
  bool ok_ = true;
};

}  // namespace hm::detail
