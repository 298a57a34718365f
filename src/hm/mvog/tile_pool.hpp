#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace hm::mvog {

/// Memory pool for blocks of 16-bit units, in steps of 64 bytes, allocated from slabs of 16 KiB; larger
/// blocks are separate slabs. Returned blocks are reused for blocks of about their size.
class TilePool {
 public:
  static constexpr std::size_t kStepUnits = 32, kSlabUnits = 8192, kMaxPooledUnits = 2048;

  struct Block {
    std::uint16_t* units = nullptr;
    std::uint32_t capacity = 0;  ///< in units
  };
  /// Returns a block for at least `units` units; its contents are undefined.
  Block take(std::size_t units);
  void give_back(Block block);
  /// Estimate of the bytes that take(units) would add to bytes().
  [[nodiscard]] std::size_t cost(std::size_t units) const;
  /// Memory of the pool in bytes, including its own lists.
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
  std::size_t slab_used_ = kSlabUnits;  ///< used units of the last shared slab
  std::size_t held_units_ = 0;
  /// Free blocks by capacity / kStepUnits; each begins with the address of the next.
  std::array<std::uint16_t*, kClasses> free_{};
};

}  // namespace hm::mvog
