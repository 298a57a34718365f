#pragma once
#include <string>

#include "hm/tsdf/grid/volume_grid.hpp"

namespace hm {

/// Description of the first difference of two grids (volumes, voxels, colours); empty when they are equal.
std::string difference_of(const VolumeGrid& a, const VolumeGrid& b);

}  // namespace hm
