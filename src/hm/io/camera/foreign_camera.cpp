#include "hm/io/camera/foreign_camera.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/bytes/input_file.hpp"
#include "hm/io/bytes/json.hpp"
#include "hm/io/bytes/text_lines.hpp"
#include "hm/io/camera/camera_file.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMaxJsonBytes = 1 << 20;

Result<JsonValue> read_json(const fs::path& path) {
  const auto bytes = read_file_bytes(path, kMaxJsonBytes);
  if (!bytes) return forward_error(bytes);
  return parse_json({reinterpret_cast<const char*>(bytes->data()), bytes->size()}, path.string());
}

/// Sizes and units of a JSON object by the names that its program gives them; 0 or absent: not named.
void take_size(const JsonValue& from, std::string_view width, std::string_view height, std::string_view scale,
               ForeignCamera& found) {
  found.camera.width = static_cast<int>(std::clamp(from.number_at(width, 0), 0.0, 32768.0));
  found.camera.height = static_cast<int>(std::clamp(from.number_at(height, 0), 0.0, 32768.0));
  if (const double units = from.number_at(scale, 0); units > 0) found.depth_units_per_m = units;
}

/// {"width": .., "height": .., "intrinsic_matrix": [fx, 0, 0, 0, fy, 0, cx, cy, 1], "depth_scale": ..}
Result<ForeignCamera> read_open3d(const fs::path& path) {
  const auto json = read_json(path);
  if (!json) return forward_error(json);
  const JsonValue::Array& columns = json->list_at("intrinsic_matrix");
  if (columns.size() != 9)
    return fail(ErrorCode::kCorrupted, path, "`intrinsic_matrix` has {} numbers instead of 9",
                columns.size());
  std::array<double, 9> rows{};
  for (std::size_t i = 0; i < 9; ++i)
    rows[i % 3 * 3 + i / 3] = columns[i].number_or(std::numeric_limits<double>::quiet_NaN());
  const auto camera = camera_of_matrix(rows, path);
  if (!camera) return forward_error(camera);
  ForeignCamera found{*camera, {}, path};
  take_size(*json, "width", "height", "depth_scale", found);
  return found;
}

/// {"camera": {"w": .., "h": .., "fx": .., "fy": .., "cx": .., "cy": .., "scale": ..}}
Result<ForeignCamera> read_replica(const fs::path& path) {
  const auto json = read_json(path);
  if (!json) return forward_error(json);
  const JsonValue* values = json->find("camera");
  if (values == nullptr) return fail(ErrorCode::kCorrupted, path, "there is no `camera`");
  const auto value = [&](std::string_view key) {
    return values->number_at(key, std::numeric_limits<double>::quiet_NaN());
  };
  const auto camera = camera_of_matrix(
      std::array{value("fx"), 0.0, value("cx"), 0.0, value("fy"), value("cy"), 0.0, 0.0, 1.0}, path);
  if (!camera) return forward_error(camera);
  ForeignCamera found{*camera, {}, path};
  take_size(*values, "w", "h", "scale", found);
  return found;
}

/// Lines `m_depthWidth = 640`, `m_calibrationDepthIntrinsic = 582.9 0 320 0 0 582.9 240 0 ...`.
Result<ForeignCamera> read_sensor_info(const fs::path& path) {
  const auto text = TextFile::read(path);
  if (!text) return forward_error(text);
  std::vector<double> matrix;
  ForeignCamera found{{}, {}, path};
  double width = 0, height = 0;
  for (const TextLine& line : text->lines()) {
    const std::vector<std::string_view> parts = words(line.text);
    if (parts.size() < 3 || parts[1] != "=") continue;
    std::vector<double> values;
    for (std::size_t i = 2; i < parts.size(); ++i)
      values.push_back(parse_number(parts[i]).value_or(std::numeric_limits<double>::quiet_NaN()));
    if (parts[0] == "m_calibrationDepthIntrinsic") matrix = values;
    if (parts[0] == "m_depthWidth") width = values[0];
    if (parts[0] == "m_depthHeight") height = values[0];
    if (parts[0] == "m_depthShift" && values[0] > 0) found.depth_units_per_m = values[0];
  }
  const auto camera = camera_of_matrix(matrix, path);
  if (!camera) return forward_error(camera);
  found.camera = *camera;
  if (width >= 1 && width <= 32768 && height >= 1 && height <= 32768)
    found.camera.width = static_cast<int>(width), found.camera.height = static_cast<int>(height);
  return found;
}

Result<ForeignCamera> read_matrix(const fs::path& path) {
  const auto camera = read_intrinsics_matrix(path);
  if (!camera) return forward_error(camera);
  return ForeignCamera{*camera, {}, path};
}

/// info.txt is a common name: only one that speaks of a depth camera is read.
bool is_sensor_info(const fs::path& path) {
  const auto text = TextFile::read(path);
  return text && std::ranges::any_of(text->lines(), [](const TextLine& line) {
           return line.text.find("m_calibrationDepthIntrinsic") != std::string_view::npos;
         });
}

}  // namespace

Result<std::optional<ForeignCamera>> find_foreign_camera(const fs::path& folder) {
  const auto found = [](Result<ForeignCamera> camera) -> Result<std::optional<ForeignCamera>> {
    if (!camera) return forward_error(camera);
    return std::optional(std::move(*camera));
  };
  for (const char* name : {"intrinsic.json", "camera_intrinsic.json", "camera_primesense.json"})
    if (is_file(folder / name)) return found(read_open3d(folder / name));
  for (const char* name : {"intrinsic/intrinsic_depth.txt", "intrinsics_depth.txt"})
    if (is_file(folder / name)) return found(read_matrix(folder / name));
  for (const char* name : {"info.txt", "_info.txt"})
    if (is_file(folder / name) && is_sensor_info(folder / name))
      return found(read_sensor_info(folder / name));
  for (const fs::path& path : {folder / "cam_params.json", folder / ".." / "cam_params.json"})
    if (is_file(path)) return found(read_replica(path));
  return std::nullopt;
}

}  // namespace hm
