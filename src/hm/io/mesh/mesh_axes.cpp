#include <cmath>
#include <cstdint>
#include <string>

#include "hm/io/bytes/file_name.hpp"
#include "hm/io/bytes/json.hpp"
#include "hm/io/mesh/glb_format.hpp"
#include "hm/io/mesh/mesh_formats.hpp"

namespace hm {
namespace {

constexpr const char *kUpKey = "up", *kRotationKey = "R_gltf_frame";

/// From z up to y up: a quarter turn around x.
Mat3 y_from_z_up() {
  Mat3 R;
  R << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  return R;
}

std::optional<Mat3> rotation_of(const JsonValue::Array* numbers) {
  if (!numbers || numbers->size() != 9) return std::nullopt;
  Mat3 R;
  for (std::size_t i = 0; i < 9; ++i)
    R(static_cast<Eigen::Index>(i / 3), static_cast<Eigen::Index>(i % 3)) = (*numbers)[i].number_or(NAN);
  if (!is_rigid({R, Vec3::Zero()})) return std::nullopt;
  return R;
}

/// The direction of the first line that begins with `key`, up to the end of a header.
std::optional<UpDirection> up_in_header(InputFile& file, std::string_view key) {
  constexpr std::size_t kMost = 4096;
  std::string text(std::min<std::size_t>(kMost, file.size()), '\0');
  if (!file.read(text.data(), text.size())) return std::nullopt;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    const std::string_view line(text.data() + at, end - at);
    if (line.starts_with("end_header")) break;
    if (line.starts_with(key)) return parse_up(line.substr(key.size()));
    at = end + 1;
  }
  return std::nullopt;
}

/// The JSON chunk, which comes first (glTF 2.0, 4.4.3).
Result<JsonValue> read_document(InputFile& file) {
  std::uint32_t word = 0, length = 0;
  for (int i = 0; i < 3; ++i) file.read_value(word);
  if (!file.read_value(length) || !file.read_value(word) || word != glb::kJsonChunk ||
      length > file.size() - file.offset())
    return fail(ErrorCode::kCorrupted, file.name(), "not a GLB file");
  std::string json(length, ' ');
  if (!file.read(json.data(), json.size())) return fail(ErrorCode::kTruncated, file.name(), "ends too early");
  return parse_json(json, file.name() + " (JSON chunk)");
}

}  // namespace

Mat3 gltf_rotation(const UpDirection& up) {
  if (!up.known()) return Mat3::Identity();
  return y_from_z_up() * rotation_to_z_up(up.up);
}

JsonValue gltf_extras(const MeshWriteOptions& options) {
  const Mat3 R = gltf_rotation(options.up);
  JsonValue::Array rows;
  for (Eigen::Index i = 0; i < 9; ++i) rows.emplace_back(R(i / 3, i % 3));
  return JsonValue::object({{"frame", options.frame},
                            {"units", "metres"},
                            {kUpKey, to_string(options.up)},
                            {kRotationKey, std::move(rows)}});
}

GltfAxes gltf_axes(const JsonValue& document) {
  const JsonValue* asset = document.find("asset");
  const JsonValue* extras = asset ? asset->find("extras") : nullptr;
  const auto R_gltf_mesh = rotation_of(extras ? extras->find_as<JsonValue::Array>(kRotationKey) : nullptr);
  if (!R_gltf_mesh) return {y_from_z_up().transpose(), z_is_up()};
  const auto* text = extras->find_as<std::string>(kUpKey);
  const auto up = text ? parse_up(*text) : std::nullopt;
  return {R_gltf_mesh->transpose(), up.value_or(UpDirection())};
}

Result<std::optional<UpDirection>> read_mesh_up(const std::filesystem::path& path) {
  const std::string extension = lower_extension(path);
  auto file = InputFile::open(path);
  if (!file) return forward_error(file);
  if (extension == ".ply") return up_in_header(*file, "comment up ");
  if (extension == ".obj") return up_in_header(*file, "# up ");
  if (extension != ".glb") return fail(ErrorCode::kUnsupported, path.string(), "not a mesh file");
  const auto document = read_document(*file);
  if (!document) return forward_error(document);
  return std::optional(gltf_axes(*document).up);
}

}  // namespace hm
