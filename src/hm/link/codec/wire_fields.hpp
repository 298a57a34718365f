#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

/// How the fields of a packet stand in its bytes: little-endian integers and IEEE 754 floats, arrays element
/// by element. A packet is an aggregate with defaults and one member function that names its fields:
///
///     template <class Self, class Visitor>
///     static constexpr void visit(Self& self, Visitor&& v) {
///       v.field("x", self.x);
///       v.extension("quality", self.quality);  // MAVLink 2 only: behind all fields, not part of CRC_EXTRA
///     }
///
/// No packet here has a field of double precision, so that the codecs also run on a Cortex-M4F as they are.
namespace hm {

template <class T>
struct WireType {
  using Element = T;
  static constexpr std::uint8_t kCount = 0;  ///< 0: not an array
};
template <class T, std::size_t kElements>
struct WireType<std::array<T, kElements>> {
  using Element = T;
  static constexpr std::uint8_t kCount = kElements;
};

}  // namespace hm
