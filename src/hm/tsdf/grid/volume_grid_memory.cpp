// Packed volumes and snapshots of a VolumeGrid.
#include <algorithm>
#include <atomic>
#include <bit>
#include <utility>

#include "hm/core/check.hpp"
#include "hm/tsdf/grid/volume_grid_impl.hpp"

namespace hm {
namespace {

constexpr std::size_t kPackedArrayBytes = sizeof(std::array<PackedVolume, kPageVolumes>);
/// pack_idle() visits 1/kSweepCalls of the table per call, and packs at most about kVolumesPerCall volumes.
constexpr std::size_t kSweepCalls = 32, kVolumesPerCall = 400;

template <class Body>
void for_each_place(std::uint64_t places, Body&& body) {
  for (; places != 0; places &= places - 1) body(static_cast<unsigned>(std::countr_zero(places)));
}

std::size_t planes_of(const PackedVolume& packed) { return packed.has_colors() ? 2 : 1; }

}  // namespace

// ---- packing ----

Volume* VolumeGrid::Impl::find(VolumeKey key, Page*& page) {
  page = pages.find(page_of(key));
  if (!page) return nullptr;
  const unsigned place = place_in_page(key);
  if ((page->occupied >> place & 1u) == 0) return nullptr;
  Volume& volume = page->volumes[place];
  // Another reader may be unpacking it: its voxels are published last.
  if (!std::atomic_ref(volume.voxels).load(std::memory_order_acquire)) unpack(*page, place);
  return &volume;
}

void VolumeGrid::Impl::unpack(Page& page, unsigned place) {
  const std::scoped_lock lock(unpacking);
  Volume& volume = page.volumes[place];
  if (volume.voxels) return;  // another thread was faster
  const PackedVolume& packed = (*page.packed)[place];
  auto* voxels = static_cast<TsdfVoxel*>(pool.take());
  auto* colors = packed.has_colors() ? static_cast<ColorVoxel*>(pool.take()) : nullptr;
  packed.unpack(voxels, colors);
  drop_packed(page, place);
  page.last_used = pack_calls;
  volume.colors = colors;
  std::atomic_ref(volume.voxels).store(voxels, std::memory_order_release);
}

void VolumeGrid::Impl::drop_packed(Page& page, unsigned place) {
  PackedVolume& packed = (*page.packed)[place];
  packed_bytes -= packed.bytes();
  packed_planes -= planes_of(packed);
  packed = {};
}

void VolumeGrid::Impl::pack(Page& page, unsigned place) {
  if (!page.packed) {
    page.packed = std::make_unique<std::array<PackedVolume, kPageVolumes>>();
    packed_bytes += kPackedArrayBytes;
  }
  Volume& volume = page.volumes[place];
  PackedVolume& packed = (*page.packed)[place];
  packed = PackedVolume::pack(volume.voxels, volume.colors);
  packed_bytes += packed.bytes();
  packed_planes += planes_of(packed);
  pool.give_back(std::exchange(volume.voxels, nullptr), true);
  if (volume.colors) pool.give_back(std::exchange(volume.colors, nullptr), true);
}

void VolumeGrid::Impl::remove_page(Page& page) {
  if (page.packed) packed_bytes -= kPackedArrayBytes;
  pages.remove(page.key);
}

void VolumeGrid::pack_idle(int idle_calls) {
  Impl& impl = *impl_;
  ++impl.pack_calls;
  const std::size_t slots = impl.pages.slot_count();
  std::size_t packed = 0;
  for (std::size_t looked_at = 0; looked_at < slots / kSweepCalls && packed < kVolumesPerCall; ++looked_at) {
    Page* page = impl.pages.page_in_slot(impl.next_slot++ % slots);
    if (!page || impl.pack_calls - page->last_used <= static_cast<std::uint32_t>(idle_calls)) continue;
    for_each_place(page->occupied, [&](unsigned place) {
      if (!page->volumes[place].voxels) return;
      impl.pack(*page, place);
      ++packed;
    });
  }
}

void VolumeGrid::pack(VolumeKey key) {
  Page* page = impl_->pages.find(page_of(key));
  if (page && page->volumes[place_in_page(key)].voxels) impl_->pack(*page, place_in_page(key));
}

// ---- snapshots ----

void VolumeGrid::begin_snapshot(const VolumesByPage& wanted) {
  end_snapshot();
  impl_->snapshot.resize(wanted.size());
  std::uint32_t number = 0;
  for (const auto& [page_key, places] : wanted) {
    impl_->snapshot[number] = {page_key, places, {}};
    if (Page* page = impl_->pages.find(page_key)) {
      page->awaited = places & page->occupied;
      page->snapshot_place = number;
    }
    ++number;
  }
}

void VolumeGrid::end_snapshot() {
  for (std::size_t i = impl_->next_in_snapshot; i < impl_->snapshot.size(); ++i)
    if (Page* page = impl_->pages.find(impl_->snapshot[i].page)) page->awaited = 0;
  impl_->snapshot.clear();
  impl_->next_in_snapshot = 0;
}

bool VolumeGrid::snapshot_under_way() const { return !impl_->snapshot.empty(); }

void VolumeGrid::Impl::add_to_snapshot(Page& page, unsigned place) {
  const Volume& volume = page.volumes[place];
  VolumeSnapshot kept{volume.key, (page.interior >> place & 1u) != 0, {}};
  kept.contents =
      volume.voxels ? PackedVolume::pack(volume.voxels, volume.colors) : (*page.packed)[place].copy();
  snapshot[page.snapshot_place].volumes.push_back(std::move(kept));
  page.awaited &= ~(std::uint64_t{1} << place);
}

std::vector<PageSnapshot> VolumeGrid::take_snapshot(std::size_t volumes) {
  std::vector<PageSnapshot> taken;
  std::size_t count = 0;
  while (count < volumes && impl_->next_in_snapshot < impl_->snapshot.size()) {
    PageSnapshot& next = impl_->snapshot[impl_->next_in_snapshot];
    if (Page* page = impl_->pages.find(next.page))
      for_each_place(page->awaited, [&](unsigned place) { impl_->add_to_snapshot(*page, place); });
    count += 1 + next.volumes.size();
    taken.push_back(std::move(next));
    ++impl_->next_in_snapshot;
  }
  if (impl_->next_in_snapshot == impl_->snapshot.size()) end_snapshot();
  return taken;
}

}  // namespace hm
