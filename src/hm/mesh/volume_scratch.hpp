#pragma once
#include <cstddef>
#include <cstdint>

#include "hm/mesh/cell_rows.hpp"
#include "hm/tsdf/grid/volume.hpp"

namespace hm {

/// Internal to mesh/: voxels of a volume and its neighbours; arrays of unknown voxels for missing ones,
/// nullptr without colour.
struct Neighborhood {
  const TsdfVoxel* voxels[27];
  const ColorVoxel* colors[27];
  static constexpr int at(int dx, int dy, int dz) { return (dz + 1) * 9 + (dy + 1) * 3 + dx + 1; }
};

/// Internal to mesh/: working memory for one volume; fits into the L1 cache. Need not be cleared between
/// volumes.
struct alignas(64) VolumeScratch {
  // Distances of voxels -1..9 of every axis, unknown where not observed. A row holds x = -8..15.
  static constexpr std::int16_t kUnknown = -32768;
  static constexpr int kFieldStride = 24, kFieldSide = 11;
  static constexpr int field_at(int x, int y, int z) {
    return ((z + 1) * kFieldSide + y + 1) * kFieldStride + x + 8;
  }
  std::int16_t field[kFieldSide * kFieldSide * kFieldStride + 32];

  cells::PointRows observed, inside;
  cells::CubeRows cubes;
  cells::EdgeRows edges;

  // Per lattice point: gradient x, y, z (difference over two voxels) and distance; colour.
  alignas(64) std::int16_t records[4 * cells::kPoints];
  alignas(64) std::uint32_t colors[cells::kPoints];

  // Per vertex: records and colours of the two ends of its edge, then the results.
  static constexpr int kPadded = cells::kMaxVertices + 64;
  alignas(64) std::int16_t end_records[2][4 * kPadded];
  alignas(64) std::uint32_t end_colors[2][kPadded];
  alignas(64) std::uint16_t fractions[kPadded];
  alignas(64) std::uint16_t normals[kPadded];
  alignas(64) std::uint32_t vertex_colors[kPadded];
  std::uint8_t cases[kVolumeVoxels];
};

/// Vectorised steps with run-time dispatch. load_field loads voxels 0..8 of every axis and (for x) beyond,
/// and the bit rows `observed` and `inside`; load_margin the layers -1 and 9; make_records computes records
/// in rows next to cubes; finish_vertices the results of `count` vertices from their ends.
void load_field(const Neighborhood& around, std::uint16_t min_weight, VolumeScratch& scratch);
void load_margin(const Neighborhood& around, std::uint16_t min_weight, VolumeScratch& scratch);
void make_records(VolumeScratch& scratch);
void finish_vertices(std::size_t count, bool with_colors, VolumeScratch& scratch);

}  // namespace hm
