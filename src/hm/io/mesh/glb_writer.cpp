#include <array>
#include <cmath>
#include <limits>
#include <string>

#include "hm/core/json_value.hpp"
#include "hm/io/bytes/json.hpp"
#include "hm/io/image/srgb.hpp"
#include "hm/io/mesh/glb_format.hpp"
#include "hm/io/mesh/mesh_formats.hpp"

namespace hm {
namespace {

constexpr float kUnitTolerance = 1e-4f;
constexpr std::size_t kHeaderBytes = 12, kChunkHeaderBytes = 8;

Eigen::Vector3f unit(const Eigen::Vector3f& v) {
  const float squared = v.squaredNorm();
  if (std::abs(squared - 1) <= kUnitTolerance) return v;
  return squared > 0 ? Eigen::Vector3f(v / std::sqrt(squared)) : Eigen::Vector3f::UnitZ();
}

/// A value as it is stored in 16 bits.
std::int64_t linear16(std::size_t srgb) {
  return std::lround(srgb_to_linear(static_cast<double>(srgb) / 255.0) * 65535);
}

JsonValue corner(const Eigen::Vector3f& v) {
  return JsonValue::Array{static_cast<double>(v.x()), static_cast<double>(v.y()), static_cast<double>(v.z())};
}

/// Collects accessors with their buffer views, one behind the other in the binary chunk.
class Accessors {
 public:
  /// Adds an accessor; returns its index.
  int add(JsonValue accessor, std::size_t bytes, std::int64_t target) {
    views_.push_back(JsonValue::object({{"buffer", 0},
                                        {"byteOffset", static_cast<std::int64_t>(bytes_)},
                                        {"byteLength", static_cast<std::int64_t>(bytes)},
                                        {"target", target}}));
    accessor["bufferView"] = count_;
    accessors_.push_back(std::move(accessor));
    bytes_ += bytes;
    return count_++;
  }
  [[nodiscard]] std::size_t bytes() const { return bytes_; }
  void put_into(JsonValue& document) {
    document["accessors"] = accessors_;
    document["bufferViews"] = views_;
    document["buffers"].push_back(JsonValue::object({{"byteLength", static_cast<std::int64_t>(bytes_)}}));
  }

 private:
  JsonValue accessors_, views_;
  std::size_t bytes_ = 0;
  int count_ = 0;
};

JsonValue accessor_of(std::int64_t component, const char* type, std::size_t count) {
  return JsonValue::object(
      {{"componentType", component}, {"count", static_cast<std::int64_t>(count)}, {"type", type}});
}

JsonValue position_accessor(const TriangleMesh& mesh, const Eigen::Matrix3f& R_gltf_mesh) {
  Eigen::Vector3f low = R_gltf_mesh * mesh.vertices.front(), high = low;
  for (const Eigen::Vector3f& vertex : mesh.vertices) {
    const Eigen::Vector3f turned = R_gltf_mesh * vertex;
    low = low.cwiseMin(turned);
    high = high.cwiseMax(turned);
  }
  JsonValue accessor = accessor_of(glb::kFloat, "VEC3", mesh.vertices.size());
  accessor["min"] = corner(low);
  accessor["max"] = corner(high);
  return accessor;
}

/// Describes the mesh; sets the size of the binary chunk.
JsonValue describe(const TriangleMesh& mesh, const MeshWriteOptions& options, std::size_t& binary_bytes) {
  JsonValue document;
  document["asset"] = JsonValue::object({{"version", "2.0"}, {"generator", options.program}});
  document["asset"]["extras"] = gltf_extras(options);
  document["scene"] = 0;
  binary_bytes = 0;
  if (mesh.vertices.empty()) {
    document["scenes"].push_back(JsonValue::object({{"name", "empty"}}));
    return document;
  }
  document["scenes"].push_back(JsonValue::object({{"nodes", JsonValue::Array{0}}}));
  document["nodes"].push_back(JsonValue::object({{"mesh", 0}, {"name", options.frame}}));
  const std::size_t count = mesh.vertices.size();
  Accessors accessors;
  JsonValue attributes, primitive;
  attributes["POSITION"] = accessors.add(position_accessor(mesh, gltf_rotation(options.up).cast<float>()),
                                         count * 12, glb::kArrayBuffer);
  if (mesh.has_normals())
    attributes["NORMAL"] =
        accessors.add(accessor_of(glb::kFloat, "VEC3", count), count * 12, glb::kArrayBuffer);
  if (mesh.has_colors()) {
    JsonValue colors = accessor_of(glb::kUnsignedShort, "VEC4", count);
    colors["normalized"] = true;
    attributes["COLOR_0"] = accessors.add(std::move(colors), count * 8, glb::kArrayBuffer);
  }
  primitive["attributes"] = attributes;
  if (!mesh.triangles.empty())
    primitive["indices"] = accessors.add(accessor_of(glb::kUnsignedInt, "SCALAR", mesh.triangles.size() * 3),
                                         mesh.triangles.size() * 12, glb::kElementArrayBuffer);
  primitive["mode"] = mesh.triangles.empty() ? glb::kPoints : glb::kTriangles;
  primitive["material"] = 0;
  document["meshes"].push_back(JsonValue::object({{"primitives", JsonValue::Array{primitive}}}));
  JsonValue material = JsonValue::object({{"doubleSided", true}});
  material["pbrMetallicRoughness"] = JsonValue::object({{"metallicFactor", 0.0}, {"roughnessFactor", 1.0}});
  document["materials"].push_back(std::move(material));
  accessors.put_into(document);
  binary_bytes = accessors.bytes();
  return document;
}

void write_binary(OutputFile& file, const TriangleMesh& mesh, const Eigen::Matrix3f& R_gltf_mesh) {
  const auto write = [&](const Eigen::Vector3f& v) { file.write(v.data(), 12); };
  for (const Eigen::Vector3f& vertex : mesh.vertices) write(R_gltf_mesh * vertex);
  for (const Eigen::Vector3f& normal : mesh.normals) write(unit(R_gltf_mesh * normal));
  std::array<std::uint16_t, 256> linear{};
  for (std::size_t i = 0; i < linear.size(); ++i) linear[i] = static_cast<std::uint16_t>(linear16(i));
  for (const Rgb8& color : mesh.colors)
    file.write_value(std::array<std::uint16_t, 4>{linear[color.r], linear[color.g], linear[color.b], 65535});
  for (const auto& triangle : mesh.triangles) file.write_value(triangle);
}

}  // namespace

Result<void> write_glb(OutputFile& file, const TriangleMesh& mesh, const MeshWriteOptions& options) {
  std::size_t binary_bytes = 0;
  std::string json = to_json_text(describe(mesh, options, binary_bytes), JsonStyle::kCompact);
  json.resize((json.size() + 3) / 4 * 4, ' ');
  const std::size_t total = kHeaderBytes + kChunkHeaderBytes + json.size() +
                            (binary_bytes > 0 ? kChunkHeaderBytes + binary_bytes : 0);
  if (total > std::numeric_limits<std::uint32_t>::max())
    return fail(ErrorCode::kUnsupported, "", "{} bytes are more than a GLB file holds; PLY has no such limit",
                total);
  const auto write_word = [&file](std::size_t word) { file.write_value(static_cast<std::uint32_t>(word)); };
  write_word(glb::kMagic);
  write_word(glb::kVersion);
  write_word(total);
  write_word(json.size());
  write_word(glb::kJsonChunk);
  file.write(json);
  if (binary_bytes == 0) return {};
  // Every accessor's size is a multiple of 4, so that the chunk needs no padding.
  write_word(binary_bytes);
  write_word(glb::kBinChunk);
  write_binary(file, mesh, gltf_rotation(options.up).cast<float>());
  return {};
}

}  // namespace hm
