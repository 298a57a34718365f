#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "hm/core/check.hpp"
#include "hm/tsdf/grid/volume.hpp"

namespace hm {

/// Internal to mesh/: hash map from volume key to number; open addressing in one array. Keys must be within
/// +-2^20 volumes of the origin on each axis.
class VolumeIndex {
 public:
  static constexpr std::uint32_t kNone = 0xffffffffu;

  [[nodiscard]] std::uint32_t find(VolumeKey key) const {
    if (slots_.empty()) return kNone;
    for (std::size_t i = place(key);; i = (i + 1) & (slots_.size() - 1)) {
      if (slots_[i].number == kNone) return kNone;
      if (slots_[i].key == key) return slots_[i].number;
    }
  }
  /// Number of a key; a new key is added with number `next`.
  std::uint32_t find_or_add(VolumeKey key, std::uint32_t next) {
    if (2 * (count_ + 1) > slots_.size()) grow();
    for (std::size_t i = place(key);; i = (i + 1) & (slots_.size() - 1)) {
      if (slots_[i].number == kNone) {
        slots_[i] = {key, next};
        ++count_;
        return next;
      }
      if (slots_[i].key == key) return slots_[i].number;
    }
  }
  void clear() {
    slots_.clear();
    count_ = 0;
  }
  [[nodiscard]] std::size_t bytes() const { return slots_.capacity() * sizeof(Slot); }

 private:
  struct Slot {
    VolumeKey key;
    std::uint32_t number = kNone;
  };

  [[nodiscard]] std::size_t place(VolumeKey key) const {
    const auto part = [](std::int32_t v) {
      return static_cast<std::uint64_t>(static_cast<std::uint32_t>(v));
    };
    std::uint64_t h = part(key.x) ^ part(key.y) << 21u ^ part(key.z) << 42u;
    h ^= h >> 32u;
    h *= 0x9e3779b97f4a7c15u;
    return static_cast<std::size_t>(h >> 32u) & (slots_.size() - 1);
  }
  void grow() {
    std::vector<Slot> old(slots_.empty() ? 64 : 2 * slots_.size());
    old.swap(slots_);
    count_ = 0;
    for (const Slot& slot : old)
      if (slot.number != kNone) find_or_add(slot.key, slot.number);
  }

  std::vector<Slot> slots_;
  std::size_t count_ = 0;
};

}  // namespace hm
