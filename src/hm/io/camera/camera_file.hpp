#pragma once
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/geometry/camera.hpp"

namespace hm {

/// Contents of a camera.txt.
struct CameraFile {
  PinholeCamera camera;  ///< width and height are 0 when the file does not name them
  std::optional<double> depth_units_per_m;
  std::optional<double> rate_hz;
  std::vector<std::string> unknown_keys;
};

/// Reads lines `key value`: fx fy cx cy (required), width height k1 k2 p1 p2 k3 depth_scale (units per metre)
/// rate_hz. The separator may also be `=` or `:`; # starts a comment. Errors name file:line.
Result<CameraFile> read_camera_file(const std::filesystem::path& path);

/// Runs check_camera() for a camera whose size may not be known (0 x 0). The error names `where`.
Result<void> check_intrinsics(PinholeCamera camera, const std::string& where);

/// Limit of what a file may give: a whole size of 1 to 32768 pixels.
bool is_image_size(double pixels);

/// Error unless there are 1 to 1e6 units of depth per metre; it names the reciprocal where metres per unit
/// (as RealSense has them: 0.001) were given. `name` is what the user wrote before the number.
Result<void> check_depth_scale(double units_per_m, const std::string& where, std::string_view name);
/// The same for --depth-units-per-m; kUsage.
Result<void> check_given_depth_scale(double units_per_m);

/// Camera of an intrinsics matrix, row by row, 3x3 or 4x4 (fx 0 cx 0, 0 fy cy 0, 0 0 1 0, 0 0 0 1). Width and
/// height are 0. Error, naming `where`: another size, another shape, values that no camera has.
Result<PinholeCamera> camera_of_matrix(std::span<const double> matrix, const std::filesystem::path& where);

/// Reads such a matrix as text: the camera-intrinsics.txt of tsdf-fusion, the intrinsic_depth.txt of ScanNet.
Result<PinholeCamera> read_intrinsics_matrix(const std::filesystem::path& path);

/// Text of a camera.txt, read back exactly by read_camera_file().
std::string camera_file_text(const PinholeCamera& camera, double depth_units_per_m);

/// Published intrinsics of a TUM RGB-D recording, recognised by its name: `rgbd_dataset_freiburg2_xyz`,
/// `tum_fr1_desk_part`, `fr3_long_office_household.bag`, but not any name containing "fr2"; otherwise
/// nothing. (Sturm et al. 2012 and the data set's page.)
std::optional<PinholeCamera> known_tum_camera(std::string_view recording);

/// The same of the Bonn RGB-D Dynamic Dataset, whose recordings are called `rgbd_bonn_...` (Palazzolo et al.
/// 2019).
std::optional<PinholeCamera> known_bonn_camera(std::string_view recording);

}  // namespace hm
