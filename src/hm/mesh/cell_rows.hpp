#pragma once
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

#include "hm/tsdf/grid/volume.hpp"

/// Internal to mesh/: sample lattice of one volume as rows of bits.
///
/// The cubes of a volume have their corners on a lattice of 9 x 9 x 9 voxels: the volume's own 8^3 and one
/// layer of the neighbours at +x, +y, +z. Row r = 9 z + y holds the lattice points with that y and z, bit x
/// for x = 0..8. Being linear in y and z, neighbouring rows are r + 1 and r + 9, and rows can be combined by
/// plain loops that vectorise.
namespace hm::cells {

inline constexpr int kSide = kVolumeSide + 1;
inline constexpr int kRows = kSide * kSide;
inline constexpr int kRowPoints = 16;  ///< lattice points are numbered row * 16 + x
inline constexpr int kPoints = kRows * kRowPoints;
inline constexpr int kMaxVertices = 3 * kVolumeSide * kRows;
/// Step to the next point along x, y, z.
inline constexpr int kPointStep[3] = {1, kRowPoints, kSide* kRowPoints};

constexpr int row_of(int y, int z) { return z * kSide + y; }
constexpr int point_of(int x, int y, int z) { return row_of(y, z) * kRowPoints + x; }

/// One row of bits per (y, z), with padding rows of zeros before the first and after the last.
template <class Bits>
struct Rows {
  static constexpr int kBefore = 16, kAfter = 16;
  Bits bits[kBefore + kRows + kAfter];
  Bits& operator[](int row) { return bits[kBefore + row]; }
  const Bits& operator[](int row) const { return bits[kBefore + row]; }
  void clear() {
    for (Bits& b : bits) b = 0;
  }
};

using PointRows = Rows<std::uint16_t>;
using CubeRows = Rows<std::uint16_t>;  ///< bit x: the cube with this low corner is meshed

/// Lattice edges with a vertex: by direction and by the row and x of the edge's low end.
struct EdgeRows {
  PointRows along[3];
};

/// Finds the meshed cubes: all 8 corners observed, some inside and some outside. Returns true if there are
/// any.
inline bool find_cubes(const PointRows& observed, const PointRows& inside, CubeRows& cubes) {
  std::uint16_t any = 0;
  for (int z = 0; z < kVolumeSide; ++z)
    for (int y = 0; y < kVolumeSide; ++y) {
      const int r = row_of(y, z);
      const auto known =
          static_cast<unsigned>(observed[r] & observed[r + 1] & observed[r + 9] & observed[r + 10]);
      const auto all = static_cast<unsigned>(inside[r] & inside[r + 1] & inside[r + 9] & inside[r + 10]);
      const auto some = static_cast<unsigned>(inside[r] | inside[r + 1] | inside[r + 9] | inside[r + 10]);
      const unsigned mixed = (some | some >> 1u) & ~(all & all >> 1u);
      cubes[r] = static_cast<std::uint16_t>(known & known >> 1u & mixed & 0xffu);
      any |= cubes[r];
    }
  return any != 0;
}

/// Finds the edges that the surface crosses and that belong to a meshed cube. `cubes` is 0 where y or z is 8
/// and outside.
inline void find_edges(const CubeRows& cubes, const PointRows& inside, EdgeRows& edges) {
  for (int r = 0; r < kRows; ++r) {
    const unsigned s = inside[r];
    const unsigned along_y = cubes[r] | cubes[r - 9], along_z = cubes[r] | cubes[r - 1];
    const unsigned around_x = along_y | cubes[r - 1] | cubes[r - 10];
    edges.along[0][r] = static_cast<std::uint16_t>((s ^ s >> 1u) & around_x);
    edges.along[1][r] = static_cast<std::uint16_t>((s ^ inside[r + 1]) & (along_y | along_y << 1u));
    edges.along[2][r] = static_cast<std::uint16_t>((s ^ inside[r + 9]) & (along_z | along_z << 1u));
  }
}

/// Case of the cube with low corner (x, row).
inline std::uint8_t cube_case(const PointRows& inside, int row, int x) {
  const auto pair = [&](int r) { return static_cast<unsigned>(inside[r] >> x) & 3u; };
  return static_cast<std::uint8_t>(pair(row) | pair(row + 1) << 2u | pair(row + 9) << 4u |
                                   pair(row + 10) << 6u);
}

/// Calls body(x) for every set bit, lowest first.
template <class Body>
void for_each_bit(unsigned bits, Body&& body) {
  for (; bits != 0; bits &= bits - 1) body(std::countr_zero(bits));
}

/// Calls body(axis, row, x) for every vertex, in the order of storage in a volume.
template <class Body>
void for_each_vertex(const EdgeRows& edges, Body&& body) {
  for (int row = 0; row < kRows; ++row)
    for (int axis = 0; axis < 3; ++axis)
      for_each_bit(edges.along[axis][row], [&](int x) { body(axis, row, x); });
}

/// Unpacked topology of a VolumeMesh: meshed cubes, signs at their corners, edges with vertices.
struct Topology {
  CubeRows cubes;
  PointRows inside;
  EdgeRows edges;

  Topology(std::span<const std::uint8_t> cube_rows, std::span<const std::uint8_t> cases) {
    cubes.clear();
    inside.clear();
    std::size_t next = 0;
    for (std::size_t i = 0; i < cube_rows.size(); ++i) {
      const int row = row_of(static_cast<int>(i % kVolumeSide), static_cast<int>(i / kVolumeSide));
      cubes[row] = cube_rows[i];
      for_each_bit(cube_rows[i], [&](int x) { add_signs(cases[next++], row, x); });
    }
    find_edges(cubes, inside, edges);
  }

 private:
  void add_signs(unsigned signs, int row, int x) {
    const auto add = [&](int r, unsigned pair) {
      inside[r] = static_cast<std::uint16_t>(inside[r] | pair << x);
    };
    add(row, signs & 3u);
    add(row + 1, signs >> 2u & 3u);
    add(row + 9, signs >> 4u & 3u);
    add(row + 10, signs >> 6u & 3u);
  }
};

/// Cube table in terms of lattice points: indices of the triangles' corners in an array with one entry per
/// edge (direction * kPoints + low point), relative to the cube's low point.
struct CornerTable {
  std::uint8_t triangle_count[256];
  std::uint16_t slots[256][16];
};
const CornerTable& corner_table();

}  // namespace hm::cells
