#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace hm {

/// SHA-256 (FIPS 180-4). Holds 108 bytes; no heap.
class Sha256 {
 public:
  using Digest = std::array<std::uint8_t, 32>;
  void add(std::span<const std::uint8_t> bytes);
  /// The digest of all bytes so far; the object is of no use afterwards.
  [[nodiscard]] Digest finish();

 private:
  void compress(const std::uint8_t* block);

  std::array<std::uint32_t, 8> state_{0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a,
                                      0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};
  std::array<std::uint8_t, 64> block_{};
  std::uint64_t bytes_ = 0;
};

}  // namespace hm
