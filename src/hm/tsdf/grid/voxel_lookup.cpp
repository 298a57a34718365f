#include "hm/tsdf/grid/voxel_lookup.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace hm {
namespace {

/// Number of cached volumes on each axis.
constexpr std::int32_t kRemembered = 16;

std::int16_t known_distance(TsdfVoxel voxel) { return voxel.weight() == 0 ? kUnknownDistance : voxel.sdf(); }

}  // namespace

VoxelLookup::VoxelLookup(const VolumeGrid& grid)
    : grid_(grid), entries_(static_cast<std::size_t>(kRemembered * kRemembered * kRemembered)) {}

const TsdfVoxel* VoxelLookup::volume(VolumeKey key) {
  const std::int32_t mask = kRemembered - 1;
  const auto place = static_cast<std::size_t>(((key.z & mask) * kRemembered + (key.y & mask)) * kRemembered +
                                              (key.x & mask));
  Entry& entry = entries_[place];
  if (!entry.filled || entry.key != key) {
    const Volume* found = grid_.find(key);
    entry = {key, found ? found->voxels : nullptr, true};
  }
  return entry.voxels;
}

void VoxelLookup::corners(std::int32_t x, std::int32_t y, std::int32_t z, std::int16_t distances[8]) {
  constexpr std::int32_t last = kVolumeSide - 1;
  if ((x & last) != last && (y & last) != last && (z & last) != last) {  // all in one volume
    const TsdfVoxel* voxels = volume({x >> 3, y >> 3, z >> 3});
    if (!voxels) {
      std::fill_n(distances, 8, kUnknownDistance);
      return;
    }
    voxels += voxel_offset(x & last, y & last, z & last);
    for (int c = 0; c < 8; ++c)
      distances[c] = known_distance(voxels[voxel_offset(c & 1, c >> 1 & 1, c >> 2)]);
    return;
  }
  for (int c = 0; c < 8; ++c) {
    const std::int32_t cx = x + (c & 1), cy = y + (c >> 1 & 1), cz = z + (c >> 2);
    const TsdfVoxel* voxels = volume({cx >> 3, cy >> 3, cz >> 3});
    distances[c] =
        voxels ? known_distance(voxels[voxel_offset(cx & last, cy & last, cz & last)]) : kUnknownDistance;
  }
}

std::optional<VolumeGrid::Sample> VoxelLookup::sample(const Vec3& p_world) {
  const Vec3 at = p_world / grid_.voxel_size_m() - Vec3::Constant(0.5);
  const Vec3 low = at.array().floor().max(-1e9).min(1e9);
  std::int16_t units[8];
  corners(static_cast<std::int32_t>(low.x()), static_cast<std::int32_t>(low.y()),
          static_cast<std::int32_t>(low.z()), units);
  std::array<double, 8> distances_m{};
  for (std::size_t c = 0; c < 8; ++c) {
    if (units[c] == kUnknownDistance) return std::nullopt;
    distances_m[c] = units[c] * grid_.sdf_unit_m();
  }
  return VolumeGrid::blend(distances_m, at - low, grid_.voxel_size_m());
}

}  // namespace hm
