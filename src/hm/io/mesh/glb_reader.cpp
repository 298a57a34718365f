#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <string_view>

#include "hm/core/json_value.hpp"
#include "hm/io/bytes/json.hpp"
#include "hm/io/image/srgb.hpp"
#include "hm/io/mesh/glb_format.hpp"
#include "hm/io/mesh/mesh_formats.hpp"

namespace hm {
namespace {

/// Where an accessor's numbers lie in the file; checked against the binary chunk.
struct Accessor {
  std::uint64_t offset = 0;  ///< in the file
  std::uint64_t stride = 0;
  std::uint64_t count = 0;
  std::size_t components = 0;
  std::int64_t component_type = 0;
};

std::size_t component_bytes(std::int64_t type) {
  switch (type) {
    case glb::kUnsignedByte:
      return 1;
    case glb::kUnsignedShort:
      return 2;
    case glb::kUnsignedInt:
    case glb::kFloat:
      return 4;
    default:
      return 0;
  }
}

std::size_t components_of(std::string_view type) {
  if (type == "SCALAR") return 1;
  if (type == "VEC3") return 3;
  return type == "VEC4" ? 4 : 0;
}

class GlbReader {
 public:
  explicit GlbReader(InputFile& file) : file_(file) {}

  Result<TriangleMesh> read() {
    if (const auto opened = read_chunks(); !opened) return forward_error(opened);
    if (const auto plain = check_features(); !plain) return forward_error(plain);
    R_mesh_gltf_ = gltf_axes(document_).R_mesh_gltf.cast<float>();
    for (const JsonValue& mesh : document_.list_at("meshes")) {
      const auto* primitives = mesh.find_as<JsonValue::Array>("primitives");
      if (!primitives) return bad("a mesh without primitives");
      for (const JsonValue& primitive : *primitives)
        if (const auto done = read_primitive(primitive); !done) return forward_error(done);
    }
    if (mesh_.normals.size() != mesh_.vertices.size()) mesh_.normals.clear();
    if (mesh_.colors.size() != mesh_.vertices.size()) mesh_.colors.clear();
    return std::move(mesh_);
  }

 private:
  [[nodiscard]] tl::unexpected<Error> bad(std::string_view what) const {
    return fail(ErrorCode::kCorrupted, file_.name(), "{}", what);
  }
  [[nodiscard]] tl::unexpected<Error> unsupported(std::string_view what) const {
    return fail(ErrorCode::kUnsupported, file_.name(), "{}", what);
  }

  Result<void> read_chunks() {
    std::uint32_t magic = 0, version = 0, total = 0;
    if (!file_.read_value(magic) || magic != glb::kMagic)
      return fail(ErrorCode::kCorrupted, file_.at_byte(0), "not a GLB file");
    if (!file_.read_value(version) || !file_.read_value(total))
      return fail(ErrorCode::kTruncated, file_.at_byte(), "ends within the header");
    if (version != glb::kVersion)
      return fail(ErrorCode::kUnsupported, file_.at_byte(4), "glTF version {}", version);
    if (total > file_.size())
      return fail(ErrorCode::kTruncated, file_.at_byte(8), "{} bytes announced, {} there", total,
                  file_.size());
    std::string json;
    bool has_json = false;
    while (file_.offset() + 8 <= total) {
      std::uint32_t length = 0, type = 0;
      const std::uint64_t at = file_.offset();
      if (!file_.read_value(length) || !file_.read_value(type) || length > total - file_.offset())
        return fail(ErrorCode::kTruncated, file_.at_byte(at), "a chunk of {} bytes does not fit", length);
      const std::uint64_t begin = file_.offset();
      if (type == glb::kJsonChunk && !has_json) {
        json.resize(length);
        has_json = file_.read(json.data(), length);
      } else if (type == glb::kBinChunk && binary_bytes_ == 0) {
        binary_begin_ = begin;
        binary_bytes_ = length;
      }
      file_.seek(begin + length);
    }
    if (!has_json) return bad("no JSON chunk");
    auto parsed = parse_json(json, file_.name() + " (JSON chunk)");
    if (!parsed) return forward_error(parsed);
    document_ = std::move(*parsed);
    return {};
  }

  [[nodiscard]] Result<void> check_features() const {
    if (!document_.list_at("extensionsRequired").empty())
      return unsupported("needs a glTF extension (compression or quantisation)");
    for (const JsonValue& node : document_.list_at("nodes"))
      for (const char* key : {"matrix", "translation", "rotation", "scale"})
        if (node.find(key)) return unsupported("a node with a transform");
    return {};
  }

  [[nodiscard]] const JsonValue* item(std::string_view list, std::int64_t index) const {
    const JsonValue::Array& items = document_.list_at(list);
    if (index < 0 || index >= static_cast<std::int64_t>(items.size())) return nullptr;
    return &items[static_cast<std::size_t>(index)];
  }

  [[nodiscard]] Result<Accessor> accessor(std::int64_t index) const {
    const JsonValue* json = item("accessors", index);
    if (!json) return bad("an accessor is missing");
    if (json->find("sparse")) return unsupported("a sparse accessor");
    const JsonValue* view = item("bufferViews", json->integer_at("bufferView", -1));
    if (!view || view->integer_at("buffer", -1) != 0)
      return bad("a buffer view is missing, or not in this file");
    Accessor result;
    result.component_type = json->integer_at("componentType", 0);
    result.components = components_of(json->text_at("type"));
    const std::uint64_t element = component_bytes(result.component_type) * result.components;
    const std::int64_t view_offset = view->integer_at("byteOffset", 0),
                       view_bytes = view->integer_at("byteLength", -1);
    const std::int64_t offset = json->integer_at("byteOffset", 0), count = json->integer_at("count", -1);
    const std::int64_t stride = view->integer_at("byteStride", static_cast<std::int64_t>(element));
    // The format's offsets have 32 bits; with that the sums below cannot overflow.
    for (const std::int64_t value : {view_offset, view_bytes, offset, count, stride})
      if (value < 0 || value > std::numeric_limits<std::uint32_t>::max())
        return bad("an accessor's place is wrong");
    if (element == 0) return unsupported("an accessor of another type than float, uint or ushort, ubyte");
    const auto u = [](std::int64_t value) { return static_cast<std::uint64_t>(value); };
    const std::uint64_t end = count == 0 ? 0 : u(offset) + u(stride) * (u(count) - 1) + element;
    if (u(stride) < element || end > u(view_bytes) || u(view_offset) + u(view_bytes) > binary_bytes_)
      return bad("an accessor reaches beyond the binary chunk");
    result.stride = u(stride);
    result.count = u(count);
    result.offset = binary_begin_ + u(view_offset) + u(offset);
    return result;
  }

  /// Calls `take` with the components of every element, as they are stored.
  template <class Take>
  Result<void> for_each_element(const Accessor& from, Take take) {
    std::array<char, 256> bytes{};
    const std::size_t element = component_bytes(from.component_type) * from.components;
    file_.seek(from.offset);
    for (std::uint64_t i = 0; i < from.count; ++i) {
      if (from.stride != element && i > 0) file_.seek(from.offset + i * from.stride);
      if (!file_.read(bytes.data(), element))
        return fail(ErrorCode::kTruncated, file_.at_byte(), "ends too early");
      take(bytes.data());
    }
    return {};
  }

  static double component(const char* element, std::int64_t type, std::size_t index) {
    const auto load = [&]<class T>(T value) {
      std::memcpy(&value, element + index * sizeof value, sizeof value);
      return static_cast<double>(value);
    };
    if (type == glb::kUnsignedByte) return load(std::uint8_t{}) / 255.0;
    if (type == glb::kUnsignedShort) return load(std::uint16_t{}) / 65535.0;
    return load(float{});
  }

  Result<void> read_primitive(const JsonValue& primitive) {
    const std::int64_t mode = primitive.integer_at("mode", glb::kTriangles);
    if (mode != glb::kTriangles && mode != glb::kPoints)
      return unsupported("a primitive of other than triangles");
    const JsonValue* attributes = primitive.find("attributes");
    if (!attributes) return bad("a primitive without attributes");
    const std::size_t first = mesh_.vertices.size();
    const auto positions = read_vectors(*attributes, "POSITION", mesh_.vertices);
    if (!positions) return positions;
    if (mesh_.vertices.size() > std::numeric_limits<std::uint32_t>::max())
      return unsupported("too many vertices");
    for (const char* name : {"NORMAL", "COLOR_0"}) {
      if (!attributes->find(name)) continue;
      const bool normals = std::string_view(name) == "NORMAL";
      const auto done = normals ? read_vectors(*attributes, name, mesh_.normals) : read_colors(*attributes);
      if (!done) return done;
      if ((normals ? mesh_.normals.size() : mesh_.colors.size()) > mesh_.vertices.size())
        return bad("more normals or colours than vertices");
    }
    return mode == glb::kTriangles ? read_triangles(primitive, first) : Result<void>();
  }

  Result<void> read_vectors(const JsonValue& attributes, std::string_view name,
                            std::vector<Eigen::Vector3f>& out) {
    const auto from = accessor(attributes.integer_at(name, -1));
    if (!from) return forward_error(from);
    if (from->component_type != glb::kFloat || from->components != 3)
      return bad("positions or normals are no floats");
    bool finite = true;
    const auto done = for_each_element(*from, [&](const char* element) {
      Eigen::Vector3f v;
      std::memcpy(v.data(), element, 12);
      finite &= v.allFinite();
      out.emplace_back(R_mesh_gltf_ * v);
    });
    if (done && !finite) return bad("a vertex is not finite");
    return done;
  }

  Result<void> read_colors(const JsonValue& attributes) {
    const auto from = accessor(attributes.integer_at("COLOR_0", -1));
    if (!from) return forward_error(from);
    if (from->component_type == glb::kUnsignedInt || from->components < 3)
      return bad("colours of a wrong type");
    return for_each_element(*from, [&](const char* element) {
      std::array<std::uint8_t, 3> rgb{};
      for (std::size_t c = 0; c < 3; ++c) {
        const double linear = component(element, from->component_type, c);
        rgb[c] = static_cast<std::uint8_t>(
            std::lround(255.0 * linear_to_srgb(linear > 0 ? std::min(linear, 1.0) : 0.0)));
      }
      mesh_.colors.push_back({rgb[0], rgb[1], rgb[2]});
    });
  }

  Result<void> read_triangles(const JsonValue& primitive, std::size_t first) {
    const std::size_t count = mesh_.vertices.size() - first;
    std::array<std::uint32_t, 3> triangle{};
    std::size_t corner = 0;
    bool in_range = true;
    const auto take = [&](std::uint64_t index) {
      in_range &= index < count;
      triangle[corner] = static_cast<std::uint32_t>(first + index);
      corner = (corner + 1) % 3;
      if (corner == 0) mesh_.triangles.push_back(triangle);
    };
    if (!primitive.find("indices")) {
      for (std::size_t i = 0; i < count; ++i) take(i);
    } else {
      const auto from = accessor(primitive.integer_at("indices", -1));
      if (!from) return forward_error(from);
      if (from->components != 1 || from->component_type == glb::kFloat) return bad("indices of a wrong type");
      const std::size_t bytes = component_bytes(from->component_type);
      const auto done = for_each_element(*from, [&](const char* element) {
        std::uint32_t index = 0;
        std::memcpy(&index, element, bytes);
        take(index);
      });
      if (!done) return done;
    }
    if (!in_range) return bad("a triangle names a vertex that is not there");
    if (corner != 0) return bad("the number of indices is not a multiple of 3");
    return {};
  }

  InputFile& file_;
  JsonValue document_;
  Eigen::Matrix3f R_mesh_gltf_;
  std::uint64_t binary_begin_ = 0, binary_bytes_ = 0;
  TriangleMesh mesh_;
};

}  // namespace

Result<TriangleMesh> read_glb(InputFile& file) { return GlbReader(file).read(); }

}  // namespace hm
