#include "hm/tsdf/testing/grid_compare.hpp"

#include <fmt/format.h>

namespace hm {

std::string difference_of(const VolumeGrid& a, const VolumeGrid& b) {
  const auto keys = a.sorted_keys();
  if (keys != b.sorted_keys())
    return fmt::format("{} and {} volumes, or others", keys.size(), b.volume_count());
  for (const VolumeKey key : keys) {
    const Volume &va = *a.find(key), &vb = *b.find(key);
    if ((va.colors == nullptr) != (vb.colors == nullptr))
      return fmt::format("colours of volume {} {} {} in one grid only", key.x, key.y, key.z);
    for (int i = 0; i < kVolumeVoxels; ++i) {
      if (va.voxels[i] != vb.voxels[i])
        return fmt::format("voxel {} of volume {} {} {}: {} (weight {}) and {} (weight {})", i, key.x, key.y,
                           key.z, va.voxels[i].sdf(), va.voxels[i].weight(), vb.voxels[i].sdf(),
                           vb.voxels[i].weight());
      if (va.colors && va.colors[i] != vb.colors[i])
        return fmt::format("colour {} of volume {} {} {}: {:08x} and {:08x}", i, key.x, key.y, key.z,
                           va.colors[i].bits, vb.colors[i].bits);
    }
  }
  return {};
}

}  // namespace hm
