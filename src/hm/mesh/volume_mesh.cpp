#include "hm/mesh/volume_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "hm/core/check.hpp"
#include "hm/mesh/cell_rows.hpp"
#include "hm/mesh/cube_table.hpp"
#include "hm/mesh/mesh_assembler.hpp"

namespace hm {
namespace {

constexpr std::size_t kCubeRows = kVolumeSide * kVolumeSide;

template <class T>
std::byte* append(std::byte* to, std::span<const T> values) {
  if (!values.empty()) std::memcpy(to, values.data(), values.size_bytes());
  return to + values.size_bytes();
}

std::uint8_t sides_touched(std::span<const std::uint8_t> cube_rows) {
  unsigned x_bits = 0, sides = 0;
  for (std::size_t i = 0; i < cube_rows.size(); ++i) {
    if (cube_rows[i] == 0) continue;
    const std::size_t y = i % kVolumeSide, z = i / kVolumeSide;
    x_bits |= cube_rows[i];
    if (y == 0) sides |= 4u;
    if (y == kVolumeSide - 1) sides |= 8u;
    if (z == 0) sides |= 16u;
    if (z == kVolumeSide - 1) sides |= 32u;
  }
  return static_cast<std::uint8_t>(sides | (x_bits & 1u) | (x_bits >> 7u) << 1u);
}

}  // namespace

VolumeMesh VolumeMesh::pack(const Parts& parts) {
  HM_CHECK(parts.cube_rows.size() == kCubeRows && parts.fractions.size() == parts.normals.size());
  VolumeMesh mesh;
  mesh.key_ = parts.key;
  if (parts.cases.empty()) return mesh;
  mesh.vertex_count_ = static_cast<std::uint16_t>(parts.fractions.size());
  mesh.cube_count_ = static_cast<std::uint16_t>(parts.cases.size());
  mesh.triangle_count_ = static_cast<std::uint16_t>(parts.triangle_count);
  mesh.touched_sides_ = sides_touched(parts.cube_rows);
  mesh.has_colors_ = !parts.colors.empty();
  const auto data = std::make_shared_for_overwrite<std::byte[]>(mesh.data_bytes());
  mesh.data_ = data;
  std::byte* to = append(append(data.get(), parts.fractions), parts.normals);
  for (const std::uint32_t color : parts.colors) {
    const std::uint8_t rgb[3] = {static_cast<std::uint8_t>(color), static_cast<std::uint8_t>(color >> 8u),
                                 static_cast<std::uint8_t>(color >> 16u)};
    std::memcpy(to, rgb, sizeof rgb);
    to += sizeof rgb;
  }
  append(append(to, parts.cases), parts.cube_rows);
  return mesh;
}

std::size_t VolumeMesh::data_bytes() const {
  if (empty()) return 0;
  return vertex_count_ * (4u + (has_colors_ ? sizeof(Rgb8) : 0u)) + cube_count_ + kCubeRows;
}

std::span<const std::uint16_t> VolumeMesh::fractions() const {
  return {reinterpret_cast<const std::uint16_t*>(data_.get()), vertex_count_};
}

std::span<const std::uint16_t> VolumeMesh::normals() const {
  return {reinterpret_cast<const std::uint16_t*>(data_.get()) + vertex_count_, vertex_count_};
}

std::span<const Rgb8> VolumeMesh::colors() const {
  static_assert(sizeof(Rgb8) == 3 && alignof(Rgb8) == 1);
  if (!has_colors_) return {};
  return {reinterpret_cast<const Rgb8*>(data_.get() + 4u * vertex_count_), vertex_count_};
}

std::span<const std::uint8_t> VolumeMesh::cases() const {
  const std::size_t offset = data_bytes() - kCubeRows - cube_count_;
  if (empty()) return {};
  return {reinterpret_cast<const std::uint8_t*>(data_.get() + offset), cube_count_};
}

std::span<const std::uint8_t> VolumeMesh::cube_rows() const {
  if (empty()) return {};
  return {reinterpret_cast<const std::uint8_t*>(data_.get() + data_bytes() - kCubeRows), kCubeRows};
}

bool VolumeMesh::operator==(const VolumeMesh& other) const {
  return key_ == other.key_ && vertex_count_ == other.vertex_count_ && cube_count_ == other.cube_count_ &&
         triangle_count_ == other.triangle_count_ && has_colors_ == other.has_colors_ &&
         std::equal(data_.get(), data_.get() + data_bytes(), other.data_.get());
}

Eigen::Vector3f unpack_normal(std::uint16_t code) {
  const auto u = static_cast<float>(static_cast<std::int8_t>(code & 0xffu));
  const auto v = static_cast<float>(static_cast<std::int8_t>(code >> 8u));
  const float z = 127.0F - std::abs(u) - std::abs(v);
  const float fold = std::max(-z, 0.0F);  // the lower half is folded out over the diagonals
  const Eigen::Vector3f normal(u - std::copysign(fold, u), v - std::copysign(fold, v), z);
  return normal / normal.norm();
}

const cells::CornerTable& cells::corner_table() {
  static const CornerTable table = [] {
    CornerTable result{};
    for (std::size_t i = 0; i < 256; ++i) {
      result.triangle_count[i] = cube_table().triangle_count[i];
      for (std::size_t k = 0; k < 3u * result.triangle_count[i]; ++k) {
        const CubeEdge edge = cube_edge(cube_table().edges[i][k]);
        result.slots[i][k] =
            static_cast<std::uint16_t>(edge.axis * kPoints + point_of(edge.low[0], edge.low[1], edge.low[2]));
      }
    }
    return result;
  }();
  return table;
}

TriangleMesh unpack(const VolumeMesh& mesh, double voxel_size_m) {
  TriangleMesh out;
  if (mesh.empty()) return out;
  out.vertices.resize(mesh.vertex_count());
  out.normals.resize(mesh.vertex_count());
  out.colors.resize(mesh.has_colors() ? mesh.vertex_count() : 0);
  out.triangles.resize(mesh.triangle_count());
  const cells::Topology topology(mesh.cube_rows(), mesh.cases());
  MeshAssembler assembler(out, voxel_size_m);
  assembler.begin(mesh);
  std::uint32_t index = 0;
  cells::for_each_vertex(topology.edges, [&](int axis, int row, int x) {
    assembler.add_vertex({axis, row, x}, index, index);
    ++index;
  });
  assembler.add_triangles(topology, 0);
  return out;
}

}  // namespace hm
