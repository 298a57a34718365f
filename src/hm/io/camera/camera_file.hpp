#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/geometry/camera.hpp"

namespace hm {

/// What a camera.txt says.
struct CameraFile {
  PinholeCamera camera;  ///< width and height are 0 when the file does not name them
  std::optional<double> depth_units_per_m;
  std::optional<double> rate_hz;
  std::vector<std::string> unknown_keys;
};

/// Reads lines `key value`: fx fy cx cy (needed), width height k1 k2 p1 p2 k3 depth_scale (units per metre)
/// rate_hz. `=` or `:` may stand between; # starts a comment, also behind a value. Errors name file:line.
Result<CameraFile> read_camera_file(const std::filesystem::path& path);

/// Reads a 3x3 matrix, as text: the camera-intrinsics.txt of tsdf-fusion. Width and height are 0.
Result<PinholeCamera> read_intrinsics_matrix(const std::filesystem::path& path);

/// The text of a camera.txt that read_camera_file() reads back exactly.
std::string camera_file_text(const PinholeCamera& camera, double depth_units_per_m);

/// The published intrinsics of the camera of a recording of TUM RGB-D, when this is the name of one:
/// `rgbd_dataset_freiburg2_xyz`, `tum_fr1_desk_part`, `fr3_long_office_household.bag`; not any name with
/// "fr2" in it. (Sturm et al. 2012 and the data set's page.)
std::optional<PinholeCamera> known_tum_camera(std::string_view recording);

}  // namespace hm
