#pragma once
#include <filesystem>

#include "hm/core/result.hpp"
#include "hm/mvog/multi_volume_grid.hpp"

namespace hm {

/// Reads a multi-volume occupancy grid (.mvog). Errors name the file and the byte.
Result<MultiVolumeGrid> read_mvog(const std::filesystem::path& path);

}  // namespace hm
