#pragma once
#include <string>

#include "hm/tsdf/grid/volume_grid.hpp"

namespace hm {

/// Where two grids first differ (volumes, voxels, colours), in words; empty when they are the same.
std::string difference_of(const VolumeGrid& a, const VolumeGrid& b);

}  // namespace hm
