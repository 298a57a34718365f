#pragma once
#include <cstddef>
#include <cstdint>

#include "hm/mesh/cell_rows.hpp"
#include "hm/mesh/volume_mesh.hpp"

namespace hm {

/// Internal to mesh/: lattice edge of a vertex, as passed by cells::for_each_vertex.
struct VertexEdge {
  int axis = 0, row = 0, x = 0;
  [[nodiscard]] int point() const { return row * cells::kRowPoints + x; }
};

/// Internal to mesh/: unpacks volumes into the arrays of a TriangleMesh in memory, which must have their
/// final size.
class MeshAssembler {
 public:
  MeshAssembler(TriangleMesh& out, double voxel_size_m) : out_(out), voxel_size_m_(voxel_size_m) {}

  void begin(const VolumeMesh& mesh);
  /// Sets the index in the result of the vertex on an edge (added here or by another volume).
  void set_index(const VertexEdge& edge, std::uint32_t index) {
    slots_[edge.axis * cells::kPoints + edge.point()] = index;
  }
  /// Stores the volume's vertex number `local` at index `index` of the result.
  void add_vertex(const VertexEdge& edge, std::size_t local, std::uint32_t index);
  /// Stores all triangles from index `first` on; the indices of all vertices must be set.
  void add_triangles(const cells::Topology& topology, std::size_t first);

 private:
  TriangleMesh& out_;
  double voxel_size_m_;
  const VolumeMesh* mesh_ = nullptr;
  std::uint32_t slots_[3 * cells::kPoints];  // by edge direction and low point; unused entries are not set
};

}  // namespace hm
