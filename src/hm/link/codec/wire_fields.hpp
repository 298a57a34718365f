#pragma once
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <type_traits>

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

namespace detail {

template <std::size_t kBytes>
using WireBits =
    std::conditional_t<kBytes == 1, std::uint8_t,
                       std::conditional_t<kBytes == 2, std::uint16_t,
                                          std::conditional_t<kBytes == 4, std::uint32_t, std::uint64_t>>>;

template <class T>
constexpr void store_element(std::uint8_t* to, T value) {
  auto bits = std::bit_cast<WireBits<sizeof(T)>>(value);
  for (std::size_t i = 0; i < sizeof(T); ++i)
    to[i] = static_cast<std::uint8_t>(static_cast<std::uint64_t>(bits) >> (8 * i));
}

template <class T>
constexpr void load_element(const std::uint8_t* from, T& value) {
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i) bits |= static_cast<std::uint64_t>(from[i]) << (8 * i);
  value = std::bit_cast<T>(static_cast<WireBits<sizeof(T)>>(bits));
}

}  // namespace detail

/// Writes a field (a number or an array of numbers) to `sizeof(field)` bytes, and reads it back.
template <class Field>
constexpr void store_field(std::uint8_t* to, const Field& field) {
  if constexpr (WireType<Field>::kCount == 0) {
    detail::store_element(to, field);
  } else {
    for (const auto& element : field) {
      detail::store_element(to, element);
      to += sizeof(element);
    }
  }
}
template <class Field>
constexpr void load_field(const std::uint8_t* from, Field& field) {
  if constexpr (WireType<Field>::kCount == 0) {
    detail::load_element(from, field);
  } else {
    for (auto& element : field) {
      detail::load_element(from, element);
      from += sizeof(element);
    }
  }
}

}  // namespace hm
