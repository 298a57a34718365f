#include "hm/io/camera/calibration_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/bytes/toml_reader_inl.hpp"

namespace hm {
namespace {

class CalibrationReader : private TomlReader {
 public:
  explicit CalibrationReader(const std::filesystem::path& path) : TomlReader(path) {}
  Result<RgbdCalibration> read(const toml::table& file);

 private:
  template <std::size_t kCount>
  std::array<double, kCount> numbers(const toml::table& table, std::string_view key, bool needed);
  double number(const toml::table& table, std::string_view key);
  std::optional<PinholeCamera> camera(const toml::table& file, std::string_view key);
  std::optional<SE3> motion(const toml::table& file);
  std::optional<DisparityModel> disparity(const toml::table& file);
  void read_correction(const toml::table& file, RgbdCalibration& calibration);
  void read_poses_of(const toml::table& file, RgbdCalibration& calibration);
};

template <std::size_t kCount>
std::array<double, kCount> CalibrationReader::numbers(const toml::table& table, std::string_view key,
                                                      bool needed) {
  std::array<double, kCount> result{};
  const toml::node* node = table.get(key);
  if (node == nullptr) {
    if (needed) mistake(table.source(), "`{}` is missing", key);
    return result;
  }
  const toml::array* list = node->as_array();
  bool right = list != nullptr && list->size() == kCount;
  for (std::size_t i = 0; right && i < kCount; ++i) {
    const auto value = list->get(i)->is_number() ? list->get(i)->value<double>() : std::nullopt;
    right = value && std::isfinite(*value);
    if (right) result[i] = *value;
  }
  if (!right) mistake(node->source(), "`{}` takes {} finite numbers", key, kCount);
  return result;
}

double CalibrationReader::number(const toml::table& table, std::string_view key) {
  const toml::node* node = table.get(key);
  const auto value = node != nullptr && node->is_number() ? node->value<double>() : std::nullopt;
  if (!value || !std::isfinite(*value)) {
    mistake(node != nullptr ? node->source() : table.source(), "`{}` takes a finite number", key);
    return 0;
  }
  return *value;
}

std::optional<PinholeCamera> CalibrationReader::camera(const toml::table& file, std::string_view key) {
  const toml::table* found = table(file, key, {"size_px", "fx_px", "fy_px", "cx_px", "cy_px", "distortion"});
  if (found == nullptr) return std::nullopt;
  PinholeCamera camera;
  const auto size = numbers<2>(*found, "size_px", true);
  for (const double edge : size)
    if (edge < 1 || edge > 32768 || edge != std::floor(edge))
      mistake(found->source(), "`size_px` takes two whole numbers, width and height");
  if (error_) return std::nullopt;
  camera.width = static_cast<int>(size[0]), camera.height = static_cast<int>(size[1]);
  camera.fx = number(*found, "fx_px"), camera.fy = number(*found, "fy_px");
  camera.cx = number(*found, "cx_px"), camera.cy = number(*found, "cy_px");
  const auto k = numbers<5>(*found, "distortion", false);
  camera.distortion = {k[0], k[1], k[2], k[3], k[4]};
  if (error_) return std::nullopt;
  if (const auto checked = check_camera(camera); !checked)
    mistake(found->source(), "[{}]: {}", key, checked.error().message);
  return camera;
}

std::optional<SE3> CalibrationReader::motion(const toml::table& file) {
  const toml::table* found = table(file, "T_color_depth", {"xyz_m", "quaternion_xyzw"});
  if (found == nullptr) return std::nullopt;
  const auto t = numbers<3>(*found, "xyz_m", true);
  const auto q = numbers<4>(*found, "quaternion_xyzw", true);
  const Eigen::Quaterniond rotation(q[3], q[0], q[1], q[2]);
  if (std::abs(rotation.norm() - 1) > 1e-3)
    mistake(found->source(), "`quaternion_xyzw` is not of unit length");
  if (error_) return std::nullopt;
  return SE3(rotation, Vec3(t[0], t[1], t[2]));
}

std::optional<DisparityModel> CalibrationReader::disparity(const toml::table& file) {
  const toml::table* found = table(file, "depth_disparity", {"offset_per_m", "slope_per_m"});
  if (found == nullptr) return std::nullopt;
  const DisparityModel model{number(*found, "offset_per_m"), number(*found, "slope_per_m")};
  if (error_) return std::nullopt;
  if (const auto checked = check_disparity(model); !checked)
    mistake(found->source(), "[depth_disparity]: {}", checked.error().message);
  return model;
}

void CalibrationReader::read_correction(const toml::table& file, RgbdCalibration& calibration) {
  const toml::table* found = table(file, "depth_correction", {"file"});
  if (found == nullptr || error_) return;
  const auto name = (*found)["file"].value<std::string>();
  if (!name || name->empty())
    return mistake(found->source(), "[depth_correction] needs `file = \"NAME.hmdc\"`");
  auto model = read_depth_correction(path_.parent_path() / *name);
  if (!model) {
    error_ = model.error();
    return;
  }
  const auto& camera = calibration.depth_camera ? calibration.depth_camera : calibration.color_camera;
  if (camera && (camera->width != model->width || camera->height != model->height))
    mistake(found->source(), "the depth correction is for {} x {}, the camera is {} x {}", model->width,
            model->height, camera->width, camera->height);
  calibration.depth_correction = std::move(*model);
}

void CalibrationReader::read_poses_of(const toml::table& file, RgbdCalibration& calibration) {
  const toml::node* node = file.get("poses_of");
  if (node == nullptr) return;
  const auto name = node->value<std::string>();
  const auto known = std::ranges::find(kPosesOfNames, name.value_or(""));
  if (known == std::end(kPosesOfNames))
    return mistake(node->source(), "`poses_of` is \"color\" or \"depth\"");
  calibration.poses_of = static_cast<PosesOf>(known - std::begin(kPosesOfNames));
}

Result<RgbdCalibration> CalibrationReader::read(const toml::table& file) {
  RgbdCalibration calibration;
  check_keys(
      file, "",
      {"poses_of", "depth_camera", "color_camera", "T_color_depth", "depth_disparity", "depth_correction"});
  read_poses_of(file, calibration);
  calibration.depth_camera = camera(file, "depth_camera");
  calibration.color_camera = camera(file, "color_camera");
  calibration.T_color_depth = motion(file);
  calibration.disparity = disparity(file);
  read_correction(file, calibration);
  if (!calibration.depth_camera && !calibration.color_camera)
    mistake(file.source(), "neither [depth_camera] nor [color_camera] is there");
  if (error_) return tl::make_unexpected(*error_);
  return calibration;
}

std::string camera_text(std::string_view key, const PinholeCamera& c) {
  const LensDistortion& d = c.distortion;
  return fmt::format(
      "\n[{}]\nsize_px = [{}, {}]\nfx_px = {}\nfy_px = {}\ncx_px = {}\ncy_px = {}\n"
      "distortion = [{}, {}, {}, {}, {}]  # k1 k2 p1 p2 k3\n",
      key, c.width, c.height, c.fx, c.fy, c.cx, c.cy, d.k1, d.k2, d.p1, d.p2, d.k3);
}

std::string motion_text(const SE3& motion) {
  const Vec3& t = motion.translation();
  const Eigen::Quaterniond q = motion.quaternion();
  return fmt::format(
      "\n[T_color_depth]  # points of the depth camera in the colour camera\nxyz_m = [{}, {}, {}]\n"
      "quaternion_xyzw = [{}, {}, {}, {}]\n",
      t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
}

}  // namespace

Result<RgbdCalibration> read_calibration(const std::filesystem::path& path) {
  auto file = parse_toml_file(path);
  if (!file && file.error().code == ErrorCode::kCorrupted)
    file.error().message +=
        " (no calibration.toml; intrinsics alone are given with --intrinsics FX FY CX CY)";
  if (!file) return forward_error(file);
  return CalibrationReader(path).read(*file);
}

Result<void> write_calibration(const std::filesystem::path& path, const RgbdCalibration& calibration) {
  std::string text = fmt::format(
      "# Depth and colour camera; readers rectify, correct the depth and register it, in this order.\n"
      "poses_of = \"{}\"  # whose poses recordings give\n",
      kPosesOfNames[static_cast<std::size_t>(calibration.poses_of)]);
  if (calibration.depth_camera) text += camera_text("depth_camera", *calibration.depth_camera);
  if (calibration.color_camera) text += camera_text("color_camera", *calibration.color_camera);
  if (calibration.T_color_depth) text += motion_text(*calibration.T_color_depth);
  if (const auto& disparity = calibration.disparity)
    text += fmt::format(
        "\n[depth_disparity]  # depth images hold raw disparity d: z = 1 / (offset + slope d)\n"
        "offset_per_m = {}\nslope_per_m = {}\n",
        disparity->offset_per_m, disparity->slope_per_m);
  if (calibration.depth_correction) {
    const std::string name = path.stem().string() + ".hmdc";
    if (auto written = write_depth_correction(path.parent_path() / name, *calibration.depth_correction);
        !written)
      return written;
    text += fmt::format("\n[depth_correction]\nfile = \"{}\"  # beside this file\n", name);
  }
  return write_file_text(path, text);
}

std::string camera_info_yaml(const PinholeCamera& c, const std::string& name) {
  const LensDistortion& d = c.distortion;
  return fmt::format(
      "image_width: {}\nimage_height: {}\ncamera_name: {}\n"
      "camera_matrix:\n  rows: 3\n  cols: 3\n  data: [{}, 0, {}, 0, {}, {}, 0, 0, 1]\n"
      "distortion_model: plumb_bob\n"
      "distortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [{}, {}, {}, {}, {}]\n"
      "rectification_matrix:\n  rows: 3\n  cols: 3\n  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n"
      "projection_matrix:\n  rows: 3\n  cols: 4\n  data: [{}, 0, {}, 0, 0, {}, {}, 0, 0, 0, 1, 0]\n",
      c.width, c.height, name, c.fx, c.cx, c.fy, c.cy, d.k1, d.k2, d.p1, d.p2, d.k3, c.fx, c.cx, c.fy, c.cy);
}

}  // namespace hm
