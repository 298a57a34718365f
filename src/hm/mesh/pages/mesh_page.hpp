#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/geometry/triangle_mesh.hpp"
#include "hm/mesh/volume_mesh.hpp"

namespace hm {

/// Levels of detail of a page: 100, 25 and 6 % of the triangles.
inline constexpr std::size_t kPageLevels = 3;

/// A level of detail of a page, encoded (docs/file_formats.md, Live view: mesh page).
struct EncodedPage {
  std::uint32_t vertices = 0, indices = 0;
  bool has_colors = false;
  Eigen::Vector3f origin_m = Eigen::Vector3f::Zero();
  float quantum_m = 0;                               ///< unit of positions, from the origin
  std::vector<std::byte> vertex_bytes, index_bytes;  ///< meshoptimizer: vertices version 0, indices version 1
};

/// Encodes the part of a mesh that lies in a page (of 4 x 4 x 4 volumes: page_of, volume_snapshot.hpp); its
/// frame is that of the map. Vertices on open edges, thus on borders between pages, are the same in all
/// levels. Positions are rounded to 1/256 voxel, or to the least multiple (a power of two) with which
/// triangles that reach far out of the page can be written; triangles that vanish by it are left out. The
/// finest level comes first; levels of an empty mesh are empty.
std::array<EncodedPage, kPageLevels> encode_page(VolumeKey key, const TriangleMesh& mesh,
                                                 double voxel_size_m);

/// The mesh of an encoded page. Errors: kCorrupted.
Result<TriangleMesh> decode_page(const EncodedPage& page);

/// A part of a mesh, by page.
struct MeshPagePart {
  VolumeKey key;
  TriangleMesh mesh;
};
/// Divides any mesh into pages by the centres of its triangles; pages in ascending order.
std::vector<MeshPagePart> divide_into_pages(const TriangleMesh& mesh, double voxel_size_m);

}  // namespace hm
