#pragma once
#include <vector>

#include "hm/tsdf/scan_stats.hpp"
#include "hm/tsdf/volume_grid.hpp"

namespace hm {

/// After carving took weight from a volume: renews its interior mark, and gives back the volume and those
/// around it that no surface needs any more, appending their keys. A volume is kept while it, or one of
/// its 26 neighbours, holds a voxel on or behind a surface; one whose voxels are all unknown goes anyway.
void settle_carved_volume(VolumeGrid& grid, VolumeKey key, std::vector<VolumeKey>& released);

/// Adds the volumes that are gone to the list of changed ones (all border layers set) and sorts it by z,
/// y, x, each volume once.
void add_released(const std::vector<VolumeKey>& released, std::vector<ChangedVolume>& changed);

}  // namespace hm
