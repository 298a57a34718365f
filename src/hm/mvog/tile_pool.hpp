#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace hm::mvog {

/// Memory for blocks of 16-bit units that grow and move, in steps of 64 bytes, carved from slabs of 16 KiB;
/// larger blocks are slabs of their own. What is given back is used again for blocks of about its size.
class TilePool {
 public:
  static constexpr std::size_t kStepUnits = 32, kSlabUnits = 8192, kMaxPooledUnits = 2048;

  struct Block {
    std::uint16_t* units = nullptr;
    std::uint32_t capacity = 0;  ///< in units
  };
  /// A block for at least `units` units. Its contents are undefined.
  Block take(std::size_t units);
  void give_back(Block block);
  /// Bytes that take(units) would add to bytes(), as far as that can be told beforehand.
  [[nodiscard]] std::size_t cost(std::size_t units) const;
  /// Everything that the pool has from the system, its own lists included.
  [[nodiscard]] std::size_t bytes() const;

 private:
  static constexpr std::size_t kClasses = kMaxPooledUnits / kStepUnits + 1;
  [[nodiscard]] std::size_t class_to_use(std::size_t wanted) const;
  void push_free(std::size_t at, std::uint16_t* block);
  std::uint16_t* pop_free(std::size_t at);
  struct Slab {
    std::unique_ptr<std::uint16_t[]> units;
    std::size_t size = 0;
  };
  std::vector<Slab> slabs_;             ///< shared ones
  std::vector<Slab> large_;             ///< one block each
  std::size_t slab_used_ = kSlabUnits;  ///< of the last shared one
  std::size_t held_units_ = 0;
  /// Free blocks by capacity / kStepUnits; each begins with the address of the next.
  std::array<std::uint16_t*, kClasses> free_{};
};

}  // namespace hm::mvog
