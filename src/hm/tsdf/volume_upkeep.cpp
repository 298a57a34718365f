#include "hm/tsdf/volume_upkeep.hpp"

#include <algorithm>
#include <tuple>

namespace hm {
namespace {

struct Contents {
  bool interior = false;  ///< a known voxel at distance <= 0
  bool known = false;
};

Contents contents_of(const Volume& volume) {
  Contents contents;
  for (int i = 0; i < kVolumeVoxels; ++i) {
    const TsdfVoxel voxel = volume.voxels[i];
    contents.known |= voxel.weight() > 0;
    contents.interior |= voxel.weight() > 0 && voxel.sdf() <= 0;
  }
  return contents;
}

template <class Visitor>
void visit_neighbourhood(VolumeKey key, Visitor&& visit) {
  for (int z = -1; z <= 1; ++z)
    for (int y = -1; y <= 1; ++y)
      for (int x = -1; x <= 1; ++x) visit(VolumeKey{key.x + x, key.y + y, key.z + z});
}

bool surface_is_near(const VolumeGrid& grid, VolumeKey key) {
  bool near = false;
  visit_neighbourhood(key, [&](VolumeKey around) { near |= grid.may_hold_interior(around); });
  return near;
}

}  // namespace

void settle_carved_volume(VolumeGrid& grid, VolumeKey key, std::vector<VolumeKey>& released) {
  const Volume* volume = grid.find(key);
  if (!volume) return;
  const Contents contents = contents_of(*volume);
  grid.set_may_hold_interior(key, contents.interior);
  if (contents.interior) return;
  const auto release = [&](VolumeKey gone) {
    grid.release(gone);
    released.push_back(gone);
  };
  if (!contents.known) release(key);
  visit_neighbourhood(key, [&](VolumeKey around) {
    if (grid.contains(around) && !surface_is_near(grid, around)) release(around);
  });
}

void add_released(const std::vector<VolumeKey>& released, std::vector<ChangedVolume>& changed) {
  for (const VolumeKey key : released) changed.push_back({key, 0x3f, true});
  const auto order = [](const ChangedVolume& v) {
    return std::tuple(v.key.z, v.key.y, v.key.x, !v.released);
  };
  std::sort(changed.begin(), changed.end(),
            [&](const auto& a, const auto& b) { return order(a) < order(b); });
  const auto same = [](const ChangedVolume& a, const ChangedVolume& b) { return a.key == b.key; };
  changed.erase(std::unique(changed.begin(), changed.end(), same), changed.end());
}

}  // namespace hm
