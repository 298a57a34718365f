#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "hm/tsdf/grid/volume_grid.hpp"

namespace hm {

/// Value for the distance of an unknown voxel.
inline constexpr std::int16_t kUnknownDistance = INT16_MIN;

/// Fast look-ups in a grid with a cache of recently used volumes. The grid must not change during its
/// lifetime.
class VoxelLookup {
 public:
  explicit VoxelLookup(const VolumeGrid& grid);
  /// Distances (sdf units) of the 2 x 2 x 2 voxels from (x, y, z) on, x fastest; kUnknownDistance for unknown
  /// ones.
  void corners(std::int32_t x, std::int32_t y, std::int32_t z, std::int16_t distances[8]);
  /// As VolumeGrid::sample().
  std::optional<VolumeGrid::Sample> sample(const Vec3& p_world);

 private:
  struct Entry {
    VolumeKey key;
    const TsdfVoxel* voxels = nullptr;
    bool filled = false;
  };
  const TsdfVoxel* volume(VolumeKey key);

  const VolumeGrid& grid_;
  std::vector<Entry> entries_;
};

}  // namespace hm
