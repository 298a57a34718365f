#include "hm/mesh/pages/mesh_page.hpp"

#include <meshoptimizer.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <mutex>
#include <span>
#include <utility>

#include "hm/core/check.hpp"
#include "hm/tsdf/grid/page_table.hpp"
#include "hm/tsdf/grid/volume_snapshot.hpp"

namespace hm {
namespace {

/// Positions are stored in this part of a voxel: 0.08 mm at 2 cm.
constexpr double kQuantaPerVoxel = 256;
/// Share of the triangles that levels 1 and 2 keep, and the error that they may make, in voxels.
constexpr std::array<double, kPageLevels - 1> kKeepRatio{0.25, 0.06};
constexpr std::array<double, kPageLevels - 1> kMaxErrorVoxels{2, 8};
constexpr std::uint8_t kErrorUnknown = 255;

/// A vertex as it is sent.
struct PageVertex {
  std::int16_t x = 0, y = 0, z = 0;
  std::int8_t u = 0, v = 0;
  std::uint8_t r = 0, g = 0, b = 0, error = kErrorUnknown;
};
static_assert(sizeof(PageVertex) == 12 && alignof(PageVertex) <= 4);

/// Octahedral code of a normal (inverse of unpack_normal).
std::array<std::int8_t, 2> octahedral(const Eigen::Vector3f& normal) {
  const float sum = normal.cwiseAbs().sum();
  if (!(sum > 0)) return {0, 0};
  const Eigen::Vector3f n = normal * (127.0F / sum);
  float u = n.x(), v = n.y();
  if (n.z() < 0) {
    u = std::copysign(127.0F - std::abs(n.y()), n.x());
    v = std::copysign(127.0F - std::abs(n.x()), n.y());
  }
  return {static_cast<std::int8_t>(std::nearbyint(u)), static_cast<std::int8_t>(std::nearbyint(v))};
}

/// Lattice of a page's positions.
struct PageLattice {
  Eigen::Vector3f origin_m;
  float quantum_m = 0;

  PageLattice(VolumeKey key, const TriangleMesh& mesh, double voxel_size_m) {
    const double side_m = kPageSide * kVolumeSide * voxel_size_m;
    const Vec3 corner = Vec3(key.x, key.y, key.z) * side_m;
    origin_m = corner.cast<float>();
    double reach_m = 0, quantum = voxel_size_m / kQuantaPerVoxel;
    for (const auto& vertex : mesh.vertices)
      reach_m = std::max(reach_m, static_cast<double>((vertex - origin_m).cwiseAbs().maxCoeff()));
    while (reach_m > 32'000 * quantum) quantum *= 2;
    quantum_m = static_cast<float>(quantum);
  }
  [[nodiscard]] std::int16_t steps(float from_origin_m) const {
    return static_cast<std::int16_t>(std::lround(from_origin_m / quantum_m));
  }
};

std::vector<PageVertex> quantised(const TriangleMesh& mesh, const PageLattice& lattice) {
  std::vector<PageVertex> out(mesh.vertices.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    const Eigen::Vector3f at = mesh.vertices[i] - lattice.origin_m;
    PageVertex& vertex = out[i];
    vertex.x = lattice.steps(at.x()), vertex.y = lattice.steps(at.y()), vertex.z = lattice.steps(at.z());
    if (mesh.has_normals()) {
      const auto code = octahedral(mesh.normals[i]);
      vertex.u = code[0], vertex.v = code[1];
    }
    const Rgb8 color = mesh.has_colors() ? mesh.colors[i] : kNeutralColor;
    vertex.r = color.r, vertex.g = color.g, vertex.b = color.b;
  }
  return out;
}

using Indices = std::vector<unsigned int>;

bool same_place(const PageVertex& a, const PageVertex& b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

/// The triangles with three different corners.
Indices indices_of(const TriangleMesh& mesh, std::span<const PageVertex> vertices) {
  Indices out;
  out.reserve(3 * mesh.triangles.size());
  for (const auto& [a, b, c] : mesh.triangles)
    if (!same_place(vertices[a], vertices[b]) && !same_place(vertices[b], vertices[c]) &&
        !same_place(vertices[c], vertices[a]))
      out.insert(out.end(), {a, b, c});
  return out;
}

/// Triangles of a level of detail, with their vertices in metres and as they are sent.
struct PageSurface {
  Indices indices;
  std::vector<Eigen::Vector3f> positions_m;
  std::vector<PageVertex> vertices;
};

/// The surface without vertices that no triangle has: the next level's time follows those that are left.
PageSurface compacted(const PageSurface& surface) {
  const std::size_t before = surface.vertices.size();
  std::vector<unsigned> place(before);
  const std::size_t used =
      meshopt_optimizeVertexFetchRemap(place.data(), surface.indices.data(), surface.indices.size(), before);
  PageSurface out{Indices(surface.indices.size()), std::vector<Eigen::Vector3f>(used),
                  std::vector<PageVertex>(used)};
  meshopt_remapIndexBuffer(out.indices.data(), surface.indices.data(), surface.indices.size(), place.data());
  meshopt_remapVertexBuffer(out.positions_m.data(), surface.positions_m.data(), before,
                            sizeof(Eigen::Vector3f), place.data());
  meshopt_remapVertexBuffer(out.vertices.data(), surface.vertices.data(), before, sizeof(PageVertex),
                            place.data());
  return out;
}

/// Fewer triangles of these vertices; those on open edges stay.
PageSurface simplified(PageSurface fine, std::size_t wanted, float max_error_m) {
  constexpr std::size_t kStride = sizeof(Eigen::Vector3f);
  const float* positions = fine.positions_m.front().data();
  const float scale = meshopt_simplifyScale(positions, fine.positions_m.size(), kStride);
  const float error = scale > 0 ? max_error_m / scale : 1.0F;
  Indices coarse(fine.indices.size());
  coarse.resize(meshopt_simplify(coarse.data(), fine.indices.data(), fine.indices.size(), positions,
                                 fine.positions_m.size(), kStride, wanted, error, meshopt_SimplifyLockBorder,
                                 nullptr));
  fine.indices = std::move(coarse);
  return compacted(fine);
}

std::vector<std::byte> as_bytes(std::span<const unsigned char> bytes) {
  std::vector<std::byte> out(bytes.size());
  std::memcpy(out.data(), bytes.data(), bytes.size());
  return out;
}

/// Orders for small code, drops the vertices that are not used, encodes.
EncodedPage encoded(Indices indices, std::span<const PageVertex> vertices, const PageLattice& lattice) {
  static std::once_flag versions;
  std::call_once(versions, [] {
    meshopt_encodeVertexVersion(0);
    meshopt_encodeIndexVersion(1);
  });
  EncodedPage page;
  page.origin_m = lattice.origin_m;
  page.quantum_m = lattice.quantum_m;
  if (indices.empty()) return page;
  meshopt_optimizeVertexCacheStrip(indices.data(), indices.data(), indices.size(), vertices.size());
  std::vector<PageVertex> used(vertices.size());
  used.resize(meshopt_optimizeVertexFetch(used.data(), indices.data(), indices.size(), vertices.data(),
                                          vertices.size(), sizeof(PageVertex)));
  std::vector<unsigned char> buffer(meshopt_encodeVertexBufferBound(used.size(), sizeof(PageVertex)));
  buffer.resize(
      meshopt_encodeVertexBuffer(buffer.data(), buffer.size(), used.data(), used.size(), sizeof(PageVertex)));
  page.vertex_bytes = as_bytes(buffer);
  buffer.resize(meshopt_encodeIndexBufferBound(indices.size(), used.size()));
  buffer.resize(meshopt_encodeIndexBuffer(buffer.data(), buffer.size(), indices.data(), indices.size()));
  page.index_bytes = as_bytes(buffer);
  page.vertices = static_cast<std::uint32_t>(used.size());
  page.indices = static_cast<std::uint32_t>(indices.size());
  return page;
}

std::int32_t page_index(float at_m, double side_m) {
  return static_cast<std::int32_t>(std::clamp(std::floor(static_cast<double>(at_m) / side_m), -1e6, 1e6));
}

}  // namespace

std::array<EncodedPage, kPageLevels> encode_page(VolumeKey key, const TriangleMesh& mesh,
                                                 double voxel_size_m) {
  HM_CHECK(voxel_size_m > 0, "voxels of {} m", voxel_size_m);
  const PageLattice lattice(key, mesh, voxel_size_m);
  PageSurface surface{{}, mesh.vertices, quantised(mesh, lattice)};
  surface.indices = indices_of(mesh, surface.vertices);
  const std::size_t finest = surface.indices.size();
  std::array<EncodedPage, kPageLevels> levels;
  for (std::size_t level = 0; level < kPageLevels; ++level) {
    if (level > 0 && !surface.indices.empty()) {
      const auto wanted = static_cast<std::size_t>(kKeepRatio[level - 1] * static_cast<double>(finest));
      surface = simplified(std::move(surface), wanted - wanted % 3,
                           static_cast<float>(kMaxErrorVoxels[level - 1] * voxel_size_m));
    }
    levels[level] = encoded(surface.indices, surface.vertices, lattice);
    levels[level].has_colors = mesh.has_colors();
  }
  return levels;
}

Result<TriangleMesh> decode_page(const EncodedPage& page) {
  const auto corrupted = [](const char* what) {
    return tl::make_unexpected(Error{ErrorCode::kCorrupted, what, "mesh page"});
  };
  if (page.indices % 3 != 0) return corrupted("its indices are not triangles");
  std::vector<PageVertex> vertices(page.vertices);
  Indices indices(page.indices);
  const auto* vertex_bytes = reinterpret_cast<const unsigned char*>(page.vertex_bytes.data());
  const auto* index_bytes = reinterpret_cast<const unsigned char*>(page.index_bytes.data());
  if (page.vertices > 0 && meshopt_decodeVertexBuffer(vertices.data(), vertices.size(), sizeof(PageVertex),
                                                      vertex_bytes, page.vertex_bytes.size()) != 0)
    return corrupted("its vertices cannot be decoded");
  if (page.indices > 0 && meshopt_decodeIndexBuffer(indices.data(), indices.size(), sizeof(unsigned),
                                                    index_bytes, page.index_bytes.size()) != 0)
    return corrupted("its indices cannot be decoded");
  TriangleMesh mesh;
  for (const PageVertex& v : vertices) {
    mesh.vertices.emplace_back(page.origin_m + page.quantum_m * Eigen::Vector3f(v.x, v.y, v.z));
    mesh.normals.push_back(unpack_normal(static_cast<std::uint16_t>(
        static_cast<std::uint8_t>(v.u) | static_cast<unsigned>(static_cast<std::uint8_t>(v.v)) << 8U)));
    if (page.has_colors) mesh.colors.push_back({v.r, v.g, v.b});
  }
  for (std::size_t i = 0; i < indices.size(); i += 3) {
    if (std::max({indices[i], indices[i + 1], indices[i + 2]}) >= page.vertices)
      return corrupted("an index is beyond its vertices");
    mesh.triangles.push_back({indices[i], indices[i + 1], indices[i + 2]});
  }
  return mesh;
}

std::vector<MeshPagePart> divide_into_pages(const TriangleMesh& mesh, double voxel_size_m) {
  HM_CHECK(voxel_size_m > 0, "voxels of {} m", voxel_size_m);
  const double side_m = kPageSide * kVolumeSide * voxel_size_m;
  std::map<VolumeKey, std::vector<std::uint32_t>, PageOrder> triangles;  // by page
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& [a, b, c] = mesh.triangles[i];
    const Eigen::Vector3f center = (mesh.vertices[a] + mesh.vertices[b] + mesh.vertices[c]) / 3;
    if (!center.allFinite()) continue;
    triangles[{page_index(center.x(), side_m), page_index(center.y(), side_m),
               page_index(center.z(), side_m)}]
        .push_back(static_cast<std::uint32_t>(i));
  }
  constexpr std::uint32_t kNotUsed = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> place(mesh.vertices.size(), kNotUsed);
  std::vector<MeshPagePart> parts;
  for (const auto& [key, numbers] : triangles) {
    MeshPagePart& part = parts.emplace_back();
    part.key = key;
    std::vector<std::uint32_t> used;
    for (const std::uint32_t number : numbers) {
      auto& triangle = part.mesh.triangles.emplace_back(mesh.triangles[number]);
      for (std::uint32_t& index : triangle) {
        if (place[index] == kNotUsed) {
          place[index] = static_cast<std::uint32_t>(used.size());
          used.push_back(index);
        }
        index = place[index];
      }
    }
    for (const std::uint32_t vertex : used) {
      part.mesh.vertices.push_back(mesh.vertices[vertex]);
      if (mesh.has_normals()) part.mesh.normals.push_back(mesh.normals[vertex]);
      if (mesh.has_colors()) part.mesh.colors.push_back(mesh.colors[vertex]);
      place[vertex] = kNotUsed;
    }
  }
  return parts;
}

}  // namespace hm
