#include "hm/mesh/mesh_assembler.hpp"

namespace hm {

void MeshAssembler::begin(const VolumeMesh& mesh) { mesh_ = &mesh; }

void MeshAssembler::add_vertex(const VertexEdge& edge, std::size_t local, std::uint32_t index) {
  set_index(edge, index);
  const VolumeKey key = mesh_->key();
  // Exact up to the last product, so that every volume that has this vertex gets the same bits.
  double at[3] = {8.0 * key.x + edge.x + 0.5, 8.0 * key.y + edge.row % cells::kSide + 0.5,
                  8.0 * key.z + edge.row / cells::kSide + 0.5};
  at[edge.axis] += mesh_->fractions()[local] / 65536.0;
  out_.vertices[index] = {static_cast<float>(at[0] * voxel_size_m_),
                          static_cast<float>(at[1] * voxel_size_m_),
                          static_cast<float>(at[2] * voxel_size_m_)};
  out_.normals[index] = unpack_normal(mesh_->normals()[local]);
  if (out_.colors.empty()) return;
  out_.colors[index] = mesh_->has_colors() ? mesh_->colors()[local] : kNeutralColor;
}

void MeshAssembler::add_triangles(const cells::Topology& topology, std::size_t first) {
  const cells::CornerTable& table = cells::corner_table();
  std::array<std::uint32_t, 3>* out = out_.triangles.data() + first;
  for (int row = 0; row < cells::kRows; ++row)
    cells::for_each_bit(topology.cubes[row], [&](int x) {
      const std::uint8_t cube = cells::cube_case(topology.inside, row, x);
      const std::uint32_t* slots = slots_ + row * cells::kRowPoints + x;
      const std::uint16_t* corner = table.slots[cube];
      for (int left = table.triangle_count[cube]; left > 0; --left, corner += 3)
        *out++ = {slots[corner[0]], slots[corner[1]], slots[corner[2]]};
    });
}

}  // namespace hm
