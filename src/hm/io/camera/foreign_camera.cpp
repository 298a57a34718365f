#include "hm/io/camera/foreign_camera.hpp"

#include <array>
#include <limits>
#include <span>
#include <vector>

#include "hm/io/bytes/input_file.hpp"
#include "hm/io/bytes/json.hpp"
#include "hm/io/bytes/text_lines.hpp"
#include "hm/io/camera/camera_file.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxJsonBytes = 1 << 20;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Values in a file besides the matrix; 0: none.
struct Stated {
  double width = 0, height = 0, units_per_m = 0;
};

using Found = Result<std::optional<ForeignCamera>>;

Found camera_of(std::span<const double> matrix, const Stated& stated, const fs::path& path) {
  const auto camera = camera_of_matrix(matrix, path);
  if (!camera) return forward_error(camera);
  ForeignCamera found{*camera, {}, path};
  for (const double size : {stated.width, stated.height})
    if (size != 0 && !is_image_size(size))
      return fail(ErrorCode::kInvalidValue, path, "images of {} pixels cannot be right", size);
  found.camera.width = static_cast<int>(stated.width);
  found.camera.height = static_cast<int>(stated.height);
  if (stated.units_per_m == 0) return found;
  if (auto checked = check_depth_scale(stated.units_per_m, path.string(), "the scale of depth"); !checked)
    return forward_error(checked);
  found.depth_units_per_m = stated.units_per_m;
  return found;
}

/// {"width": .., "height": .., "intrinsic_matrix": [fx, 0, 0, 0, fy, 0, cx, cy, 1], "depth_scale": ..}
Found read_open3d(const fs::path& path) {
  const auto json = read_json_file(path, kMaxJsonBytes);
  if (!json) return forward_error(json);
  const JsonValue::Array& columns = json->list_at("intrinsic_matrix");
  if (columns.size() != 9)
    return fail(ErrorCode::kCorrupted, path, "`intrinsic_matrix` has {} numbers instead of 9",
                columns.size());
  std::array<double, 9> rows{};
  for (std::size_t i = 0; i < 9; ++i) rows[i % 3 * 3 + i / 3] = columns[i].number_or(kNaN);
  return camera_of(
      rows, {json->number_at("width", 0), json->number_at("height", 0), json->number_at("depth_scale", 0)},
      path);
}

/// {"camera": {"w": .., "h": .., "fx": .., "fy": .., "cx": .., "cy": .., "scale": ..}}
Found read_replica(const fs::path& path) {
  const auto json = read_json_file(path, kMaxJsonBytes);
  if (!json) return forward_error(json);
  const JsonValue* values = json->find("camera");
  if (values == nullptr) return fail(ErrorCode::kCorrupted, path, "there is no `camera`");
  const auto value = [&](std::string_view key) { return values->number_at(key, kNaN); };
  return camera_of(std::array{value("fx"), 0.0, value("cx"), 0.0, value("fy"), value("cy"), 0.0, 0.0, 1.0},
                   {values->number_at("w", 0), values->number_at("h", 0), values->number_at("scale", 0)},
                   path);
}

/// Lines `m_depthWidth = 640`, `m_calibrationDepthIntrinsic = 582.9 0 320 0 0 582.9 240 0 ...`. Nothing in a
/// file without a depth camera or that cannot be read: info.txt is a common name.
Found read_sensor_info(const fs::path& path) {
  const auto text = TextFile::read(path);
  if (!text) return std::nullopt;
  std::optional<std::vector<double>> matrix;
  Stated stated;
  for (const TextLine& line : text->lines()) {
    const std::vector<std::string_view> parts = words(line.text);
    if (parts.size() < 3 || parts[1] != "=") continue;
    std::vector<double> values;
    for (std::size_t i = 2; i < parts.size(); ++i) values.push_back(parse_number(parts[i]).value_or(kNaN));
    if (parts[0] == "m_calibrationDepthIntrinsic")
      matrix = std::move(values);
    else if (parts[0] == "m_depthWidth")
      stated.width = values[0];
    else if (parts[0] == "m_depthHeight")
      stated.height = values[0];
    else if (parts[0] == "m_depthShift")
      stated.units_per_m = values[0];
  }
  if (!matrix) return std::nullopt;
  return camera_of(*matrix, stated, path);
}

/// ScanNet's files state no scale: its depth is in millimetres.
Found read_matrix(const fs::path& path) {
  constexpr double kScanNetUnits_per_m = 1000;
  const auto camera = read_intrinsics_matrix(path);
  if (!camera) return forward_error(camera);
  return ForeignCamera{*camera, kScanNetUnits_per_m, path};
}

/// ETH3D's `fx fy cx cy`. Nothing in another file: calibration.txt is a common name.
Found read_four_numbers(const fs::path& path) {
  const auto file = read_camera_file(path);
  if (!file) return std::nullopt;
  return ForeignCamera{file->camera, file->depth_units_per_m, path};
}

struct Layout {
  const char* name;
  Found (*read)(const fs::path& path);
};
constexpr std::array kLayouts{
    Layout{"intrinsic.json", read_open3d},         Layout{"camera_intrinsic.json", read_open3d},
    Layout{"camera_primesense.json", read_open3d}, Layout{"intrinsic/intrinsic_depth.txt", read_matrix},
    Layout{"intrinsics_depth.txt", read_matrix},   Layout{"info.txt", read_sensor_info},
    Layout{"_info.txt", read_sensor_info},         Layout{"cam_params.json", read_replica},
    Layout{"../cam_params.json", read_replica},    Layout{"calibration.txt", read_four_numbers}};

}  // namespace

Result<std::optional<ForeignCamera>> find_foreign_camera(const fs::path& folder) {
  for (const Layout& layout : kLayouts) {
    if (!is_file(folder / layout.name)) continue;
    if (auto found = layout.read(folder / layout.name); !found || *found) return found;
  }
  return std::nullopt;
}

}  // namespace hm
