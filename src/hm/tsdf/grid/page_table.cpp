#include "hm/tsdf/grid/page_table.hpp"

#include <utility>

#include "hm/core/check.hpp"

namespace hm {
namespace {

constexpr std::int32_t kKeyLimit = 1 << 20;  // 21 bits with sign

/// The finaliser of MurmurHash3: every input bit changes every output bit with probability 1/2.
std::uint64_t mix(std::uint64_t h) {
  h ^= h >> 33u;
  h *= 0xff51afd7ed558ccdull;
  h ^= h >> 33u;
  h *= 0xc4ceb9fe1a85ec53ull;
  return h ^ (h >> 33u);
}

}  // namespace

PageTable::PageTable() : slots_(256) {}

bool PageTable::is_representable(VolumeKey k) {
  const auto fits = [](std::int32_t v) { return v >= -kKeyLimit && v < kKeyLimit; };
  return fits(k.x) && fits(k.y) && fits(k.z);
}

std::uint64_t PageTable::pack(VolumeKey k) {
  const auto field = [](std::int32_t v) { return static_cast<std::uint64_t>(v + kKeyLimit) & 0x1fffffu; };
  return field(k.x) | field(k.y) << 21u | field(k.z) << 42u;
}

std::size_t PageTable::slot_of(std::uint64_t packed_key) const {
  const std::size_t mask = slots_.size() - 1;
  std::size_t i = mix(packed_key) & mask;
  while (slots_[i].packed_key != kEmpty && slots_[i].packed_key != packed_key) i = (i + 1) & mask;
  return i;
}

Page* PageTable::find(VolumeKey page_key) const {
  if (!is_representable(page_key)) return nullptr;
  return slots_[slot_of(pack(page_key))].page.get();
}

Page& PageTable::find_or_add(VolumeKey page_key) {
  HM_CHECK(is_representable(page_key), "page {} {} {}", page_key.x, page_key.y, page_key.z);
  if ((count_ + 1) * 2 > slots_.size()) grow();
  const std::uint64_t packed = pack(page_key);
  Slot& slot = slots_[slot_of(packed)];
  if (!slot.page) {
    slot.page = std::make_unique<Page>();  // may throw: the slot stays empty then
    slot.packed_key = packed;
    slot.page->key = page_key;
    ++count_;
  }
  return *slot.page;
}

void PageTable::remove(VolumeKey page_key) {
  const std::size_t mask = slots_.size() - 1;
  std::size_t hole = slot_of(pack(page_key));
  if (!slots_[hole].page) return;
  slots_[hole] = Slot{};
  --count_;
  // Closes the gap, so that no probe sequence is interrupted: moves back every later entry that may be stored
  // here.
  for (std::size_t i = (hole + 1) & mask; slots_[i].page; i = (i + 1) & mask) {
    const std::size_t home = mix(slots_[i].packed_key) & mask;
    if (((i - home) & mask) < ((i - hole) & mask)) continue;
    slots_[hole] = std::exchange(slots_[i], Slot{});
    hole = i;
  }
}

void PageTable::grow() {
  std::vector<Slot> old = std::exchange(slots_, std::vector<Slot>(slots_.size() * 2));
  for (Slot& slot : old)
    if (slot.page) slots_[slot_of(slot.packed_key)] = std::move(slot);
}

std::size_t PageTable::bytes() const { return slots_.size() * sizeof(Slot) + count_ * sizeof(Page); }

std::vector<Page*> PageTable::unsorted_pages() const {
  std::vector<Page*> pages;
  pages.reserve(count_);
  for (const Slot& slot : slots_)
    if (slot.page) pages.push_back(slot.page.get());
  return pages;
}

}  // namespace hm
