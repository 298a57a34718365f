#pragma once
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace hm {
namespace detail {

template <std::size_t kBytes>
using UnsignedOf =
    std::conditional_t<kBytes == 1, std::uint8_t,
                       std::conditional_t<kBytes == 2, std::uint16_t,
                                          std::conditional_t<kBytes == 4, std::uint32_t, std::uint64_t>>>;
template <class T>
inline constexpr bool kIsArray = false;
template <class T, std::size_t kCount>
inline constexpr bool kIsArray<std::array<T, kCount>> = true;

}  // namespace detail

/// Writes a number (an integer, an enumerator or an IEEE 754 float), or an array of numbers, to the
/// `sizeof(value)` bytes at `to`: little endian, on every processor. Also for microcontrollers.
template <class T>
constexpr void store_little_endian(std::uint8_t* to, const T& value) {
  if constexpr (detail::kIsArray<T>) {
    for (const auto& element : value) {
      store_little_endian(to, element);
      to += sizeof(element);
    }
  } else {
    const auto bits = std::bit_cast<detail::UnsignedOf<sizeof(T)>>(value);
    for (std::size_t i = 0; i < sizeof(T); ++i)
      to[i] = static_cast<std::uint8_t>(static_cast<std::uint64_t>(bits) >> (8 * i));
  }
}

/// The inverse. Every bit comes back, also those of numbers that are not finite.
template <class T>
constexpr void load_little_endian(const std::uint8_t* from, T& value) {
  if constexpr (detail::kIsArray<T>) {
    for (auto& element : value) {
      load_little_endian(from, element);
      from += sizeof(element);
    }
  } else {
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < sizeof(T); ++i) bits |= static_cast<std::uint64_t>(from[i]) << (8 * i);
    value = std::bit_cast<T>(static_cast<detail::UnsignedOf<sizeof(T)>>(bits));
  }
}

}  // namespace hm
