#pragma once
#include <optional>

#include "hm/calibration/depth_average.hpp"
#include "hm/pipeline/calibrate/calibration_depth.hpp"

namespace hm {

/// A folder with what was recorded at one pose of the board.
struct DepthPoseFolder {
  std::string name;  ///< "train/003"
  std::filesystem::path color;
  std::vector<std::filesystem::path> depth;  ///< in order
};

/// Poses of the board in a folder, by name: folders with depth*.png or depth*.pgm, or else files side by side
/// as the Kinect Calibration Toolbox names them (0007-d.pgm with 0007-c1.jpg). An error when there are none.
Result<std::vector<DepthPoseFolder>> list_depth_poses(const std::filesystem::path& folder,
                                                      const std::string& prefix = {});

/// Meaning of the numbers in depth images, and the camera that took them.
struct DepthReading {
  double units_per_m = 1000;
  std::optional<DisparityModel> disparity;  ///< the numbers are raw disparity
  const PinholeCamera* camera = nullptr;    ///< rectified for it; none: as they are
};

/// A depth image, in metres by its unit; not rectified. Errors name it.
Result<DepthImage> read_depth_of(const std::filesystem::path& path, const DepthReading& reading);

/// Mean and deviation of the depth images of one pose. Errors name the image.
Result<DepthAverage> average_depth(const DepthPoseFolder& pose, const DepthReading& reading);

}  // namespace hm
