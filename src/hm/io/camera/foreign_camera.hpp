#pragma once
#include <filesystem>
#include <optional>

#include "hm/core/result.hpp"
#include "hm/geometry/camera.hpp"

namespace hm {

/// Camera of the depth images as another program wrote it.
struct ForeignCamera {
  PinholeCamera camera;  ///< width and height are 0 when the file does not name them
  std::optional<double> depth_units_per_m;
  std::filesystem::path path;
};

/// Looks for a recording's camera where other programs leave it, in this order:
/// Open3D's intrinsic.json, camera_intrinsic.json or camera_primesense.json (`intrinsic_matrix`, column by
/// column; `depth_scale`); ScanNet's intrinsic/intrinsic_depth.txt or intrinsics_depth.txt (a matrix);
/// BundleFusion's and 3RScan's info.txt or _info.txt (`m_calibrationDepthIntrinsic`, `m_depthShift`);
/// Replica's cam_params.json, also in the folder above, ETH3D's calibration.txt. Nothing: there is none.
/// Error: the first that is there cannot be used.
Result<std::optional<ForeignCamera>> find_foreign_camera(const std::filesystem::path& folder);

}  // namespace hm
