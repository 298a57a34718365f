#include "hm/tsdf/projection/volume_upkeep.hpp"

#include <algorithm>
#include <iterator>
#include <tuple>

namespace hm {
namespace {

template <class Visitor>
void visit_neighbourhood(VolumeKey key, Visitor&& visit) {
  for (int z = -1; z <= 1; ++z)
    for (int y = -1; y <= 1; ++y)
      for (int x = -1; x <= 1; ++x) visit(VolumeKey{key.x + x, key.y + y, key.z + z});
}

bool surface_is_near(const VolumeGrid& grid, VolumeKey key) {
  bool near = grid.may_hold_interior(key);
  visit_neighbourhood(key, [&](VolumeKey around) { near = near || grid.may_hold_interior(around); });
  return near;
}

/// Releases a carved volume and its neighbours if no longer needed; released keys are appended to `released`.
void settle_carved(VolumeGrid& grid, const ScannedVolume& scanned, std::vector<VolumeKey>& released) {
  if (!grid.contains(scanned.key)) return;
  grid.set_may_hold_interior(scanned.key, scanned.holds_interior);
  if (scanned.holds_interior) return;
  const auto release = [&](VolumeKey gone) {
    grid.release(gone);
    released.push_back(gone);
  };
  if (!scanned.holds_known) release(scanned.key);
  visit_neighbourhood(scanned.key, [&](VolumeKey around) {
    if (grid.contains(around) && !surface_is_near(grid, around)) release(around);
  });
}

/// Adds the released volumes to the sorted list of changed ones, each volume once.
void add_released(const std::vector<VolumeKey>& released, std::vector<ChangedVolume>& changed) {
  if (released.empty()) return;
  const std::ptrdiff_t middle = std::ssize(changed);
  for (const VolumeKey key : released) changed.push_back({key, 0x3f, true});
  const auto before = [](const ChangedVolume& a, const ChangedVolume& b) {
    return std::tuple(a.key.z, a.key.y, a.key.x, !a.released) <
           std::tuple(b.key.z, b.key.y, b.key.x, !b.released);
  };
  std::sort(changed.begin() + middle, changed.end(), before);
  std::inplace_merge(changed.begin(), changed.begin() + middle, changed.end(), before);
  const auto same = [](const ChangedVolume& a, const ChangedVolume& b) { return a.key == b.key; };
  changed.erase(std::unique(changed.begin(), changed.end(), same), changed.end());
}

}  // namespace

void note_contents(ScannedVolume& scanned) {
  const TsdfVoxel* voxels = scanned.volume->voxels;
  scanned.holds_known = scanned.holds_interior = false;
  for (int layer = 0; layer < kVolumeVoxels && !scanned.holds_interior; layer += 64) {
    bool known = false, interior = false;  // branch-free, for vectorisation
    for (int i = layer; i < layer + 64; ++i) {
      known |= voxels[i].weight() > 0;
      interior |= (voxels[i].weight() > 0) & (voxels[i].sdf() <= 0);
    }
    scanned.holds_known |= known;
    scanned.holds_interior |= interior;
  }
}

void finalise_scan(VolumeGrid& grid, std::span<const ScannedVolume> scanned, ScanStats& stats) {
  stats.changed.reserve(scanned.size());
  for (const ScannedVolume& item : scanned) {
    if (!item.volume) continue;
    const VolumeUpdate& update = item.update;
    stats.voxels_updated += update.updated;
    stats.voxels_carved += update.carved;
    if (item.colors_created && update.colored == 0) grid.release_unused_colors(*item.volume);
    if (item.created && update.updated == 0) {
      if (update.freed > 0)
        grid.release(item.key);  // free space alone is not worth a volume
      else
        grid.release_unused(item.key);
      continue;
    }
    stats.volumes_created += item.created ? 1 : 0;
    if (update.interior_hit && !item.had_interior) grid.set_may_hold_interior(item.key, true);
    if (update.updated + update.freed + update.carved > 0)
      stats.changed.push_back({item.key, update.border_layers, false});
  }
  // After all marks are set: a volume emptied by carving may go only if no neighbour needs it.
  std::vector<VolumeKey> released;
  for (const ScannedVolume& item : scanned)
    if (item.volume && item.update.carved > 0) settle_carved(grid, item, released);
  stats.volumes_released = released.size();
  add_released(released, stats.changed);
}

}  // namespace hm
