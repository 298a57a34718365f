#pragma once
#include <optional>

#include "hm/calibration/depth_average.hpp"
#include "hm/pipeline/calibration_depth.hpp"

namespace hm {

/// A folder with what was recorded at one pose of the board.
struct DepthPoseFolder {
  std::string name;  ///< "train/003"
  std::filesystem::path color;
  std::vector<std::filesystem::path> depth;  ///< in order
};

/// Folders of poses in a folder, by name: those with depth*.png. An error when there are none.
Result<std::vector<DepthPoseFolder>> list_depth_poses(const std::filesystem::path& folder,
                                                      const std::string& prefix = {});

/// Mean and deviation of the depth pictures of one pose, rectified for `camera` first (none: as they are).
/// Errors name the picture.
Result<DepthAverage> average_depth(const DepthPoseFolder& pose, double units_per_m,
                                   const PinholeCamera* camera);

}  // namespace hm
