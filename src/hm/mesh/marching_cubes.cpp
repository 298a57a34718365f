#include "hm/mesh/marching_cubes.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "hm/mesh/volume_scratch.hpp"

namespace hm {
namespace {

alignas(64) constexpr TsdfVoxel kUnknownVolume[kVolumeVoxels] = {};

void look_up(const VolumeGrid& grid, VolumeKey key, int dx, int dy, int dz, Neighborhood& around) {
  const Volume* found = grid.find(VolumeKey{key.x + dx, key.y + dy, key.z + dz});
  const int place = Neighborhood::at(dx, dy, dz);
  around.voxels[place] = found ? found->voxels : kUnknownVolume;
  around.colors[place] = found ? found->colors : nullptr;
}

/// Looks up the volume itself and the seven with the far corners of its cubes.
void look_up_far(const VolumeGrid& grid, const Volume& volume, Neighborhood& around) {
  around.voxels[Neighborhood::at(0, 0, 0)] = volume.voxels;
  around.colors[Neighborhood::at(0, 0, 0)] = volume.colors;
  for (int i = 1; i < 8; ++i) look_up(grid, volume.key, i & 1, i >> 1 & 1, i >> 2, around);
}

/// Looks up the twelve volumes needed only for central differences: one step back on one axis, 0 or 1 ahead
/// on the others.
void look_up_near(const VolumeGrid& grid, VolumeKey key, Neighborhood& around) {
  for (int axis = 0; axis < 3; ++axis)
    for (int i = 0; i < 4; ++i) {
      int d[3] = {};
      d[axis] = -1;
      d[(axis + 1) % 3] = i & 1;
      d[(axis + 2) % 3] = i >> 1;
      look_up(grid, key, d[0], d[1], d[2], around);
    }
}

bool any_colors(const Neighborhood& around) {
  for (int i = 0; i < 8; ++i)
    if (around.colors[Neighborhood::at(i & 1, i >> 1 & 1, i >> 2)]) return true;
  return false;
}

void copy_colors(const ColorVoxel* from, int count, std::uint32_t* to) {
  static_assert(sizeof(ColorVoxel) == sizeof(std::uint32_t));
  if (from)
    std::memcpy(to, from, static_cast<std::size_t>(count) * sizeof *to);
  else
    std::fill_n(to, count, 0u);
}

/// Loads the colours of all lattice points in rows with ends of vertex edges.
void load_colors(const Neighborhood& around, VolumeScratch& s) {
  for (int z = 0; z < cells::kSide; ++z)
    for (int y = 0; y < cells::kSide; ++y) {
      const int r = cells::row_of(y, z);
      if ((s.cubes[r] | s.cubes[r - 1] | s.cubes[r - 9] | s.cubes[r - 10]) == 0) continue;
      const int offset = voxel_offset(0, y & 7, z & 7);
      for (int far = 0; far < 2; ++far) {
        const ColorVoxel* plane = around.colors[Neighborhood::at(far, y >> 3, z >> 3)];
        copy_colors(plane ? plane + offset : nullptr, far ? 1 : kVolumeSide,
                    s.colors + cells::point_of(8 * far, y, z));
      }
    }
}

/// Copies the two ends of every vertex's edge next to each other; returns the number of vertices.
std::size_t collect_ends(VolumeScratch& s, bool with_colors) {
  std::size_t count = 0;
  cells::for_each_vertex(s.edges, [&](int axis, int row, int x) {
    const int low = row * cells::kRowPoints + x, high = low + cells::kPointStep[axis];
    std::memcpy(s.end_records[0] + 4 * count, s.records + 4 * low, 8);
    std::memcpy(s.end_records[1] + 4 * count, s.records + 4 * high, 8);
    if (with_colors) {
      s.end_colors[0][count] = s.colors[low];
      s.end_colors[1][count] = s.colors[high];
    }
    ++count;
  });
  return count;
}

struct CubeCounts {
  std::size_t cubes = 0, triangles = 0;
};

CubeCounts collect_cases(VolumeScratch& s, std::uint8_t* cube_rows) {
  const cells::CornerTable& table = cells::corner_table();
  CubeCounts count;
  for (int i = 0; i < kVolumeSide * kVolumeSide; ++i) {
    const int row = cells::row_of(i % kVolumeSide, i / kVolumeSide);
    cube_rows[i] = static_cast<std::uint8_t>(s.cubes[row]);
    cells::for_each_bit(s.cubes[row], [&](int x) {
      const std::uint8_t cube = cells::cube_case(s.inside, row, x);
      s.cases[count.cubes++] = cube;
      count.triangles += table.triangle_count[cube];
    });
  }
  return count;
}

}  // namespace

std::uint16_t min_voxel_weight(const MeshParams& params) {
  return static_cast<std::uint16_t>(
      std::clamp(std::ceil(params.min_weight_ratio * kWeightOne), 1.0, 65535.0));
}

VolumeMesh mesh_volume(const VolumeGrid& grid, const Volume& volume, std::uint16_t min_weight) {
  VolumeScratch s;
  Neighborhood around;
  look_up_far(grid, volume, around);
  load_field(around, min_weight, s);
  s.cubes.clear();
  VolumeMesh::Parts parts;
  parts.key = volume.key;
  std::uint8_t cube_rows[kVolumeSide * kVolumeSide] = {};
  parts.cube_rows = cube_rows;
  if (!cells::find_cubes(s.observed, s.inside, s.cubes)) return VolumeMesh::pack(parts);

  look_up_near(grid, volume.key, around);
  load_margin(around, min_weight, s);
  make_records(s);
  const bool with_colors = any_colors(around);
  if (with_colors) load_colors(around, s);
  cells::find_edges(s.cubes, s.inside, s.edges);
  const std::size_t count = collect_ends(s, with_colors);
  finish_vertices(count, with_colors, s);
  const CubeCounts cubes = collect_cases(s, cube_rows);
  parts.triangle_count = cubes.triangles;
  parts.cases = {s.cases, cubes.cubes};
  parts.fractions = {s.fractions, count};
  parts.normals = {s.normals, count};
  if (with_colors) parts.colors = {s.vertex_colors, count};
  return VolumeMesh::pack(parts);
}

}  // namespace hm
