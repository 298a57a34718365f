#pragma once
#include <cstdint>
#include <ranges>

namespace hm {

/// 64-bit FNV-1a hash (Fowler, Noll, Vo) over integers in the order added. Used over bytes as the checksum of
/// this project's files; detects accidental damage, not tampering.
class Fnv1a {
 public:
  constexpr void add(std::uint64_t number) { value_ = (value_ ^ number) * 0x100000001b3u; }
  [[nodiscard]] constexpr std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0xcbf29ce484222325u;
};

/// FNV-1a hash of a range of bytes or characters.
template <std::ranges::input_range Bytes>
[[nodiscard]] constexpr std::uint64_t fnv1a(const Bytes& bytes) {
  static_assert(sizeof(std::ranges::range_value_t<Bytes>) == 1);
  Fnv1a hash;
  for (const auto byte : bytes) hash.add(static_cast<std::uint8_t>(byte));
  return hash.value();
}

}  // namespace hm
