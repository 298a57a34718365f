#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "hm/geometry/triangle_mesh.hpp"
#include "hm/tsdf/grid/volume.hpp"

namespace hm {

/// Order of volumes in the output: by z, then y, then x.
struct ScanOrder {
  bool operator()(VolumeKey a, VolumeKey b) const {
    return a.z != b.z ? a.z < b.z : a.y != b.y ? a.y < b.y : a.x < b.x;
  }
};

/// Compact mesh of one volume in memory: about 9 bytes per vertex, including triangles.
///
/// The volume owns the cubes whose low corner is one of its voxels. For each meshed cube the signs of its 8
/// corners are stored (one byte, see cube_table.hpp); they determine the crossed cube edges, hence the
/// vertices, their order and the triangles. A vertex stores its position along its edge (uint16, in 1/65536
/// of a voxel), its normal (octahedral, 2 bytes) and its colour (3 bytes). Vertices are ordered by their
/// edge's low voxel: z, y, then the edge's direction, then x.
///
/// A border vertex is stored by every volume that uses it, with the same bits. Immutable: copies share it.
class VolumeMesh {
 public:
  /// Input of pack(), which copies it. `cube_rows` has 64 rows (z * 8 + y) of 8 bits; `cases` one byte per
  /// set bit, in order; `colors` (red in the lowest byte) is empty or as long as `fractions`.
  struct Parts {
    VolumeKey key;
    std::size_t triangle_count = 0;
    std::span<const std::uint8_t> cube_rows;
    std::span<const std::uint8_t> cases;
    std::span<const std::uint16_t> fractions;
    std::span<const std::uint16_t> normals;
    std::span<const std::uint32_t> colors;
  };

  VolumeMesh() = default;
  static VolumeMesh pack(const Parts& parts);

  [[nodiscard]] VolumeKey key() const { return key_; }
  [[nodiscard]] bool empty() const { return cube_count_ == 0; }
  [[nodiscard]] bool has_colors() const { return has_colors_; }
  [[nodiscard]] std::size_t vertex_count() const { return vertex_count_; }
  [[nodiscard]] std::size_t triangle_count() const { return triangle_count_; }
  /// Memory of this mesh in bytes, including this object.
  [[nodiscard]] std::size_t bytes() const { return sizeof(VolumeMesh) + data_bytes(); }
  /// Sides with adjacent meshed cubes: bit 0..5 = low x, high x, low y, high y, low z, high z.
  [[nodiscard]] std::uint8_t touched_sides() const { return touched_sides_; }

  [[nodiscard]] std::span<const std::uint16_t> fractions() const;
  [[nodiscard]] std::span<const std::uint16_t> normals() const;
  [[nodiscard]] std::span<const Rgb8> colors() const;
  [[nodiscard]] std::span<const std::uint8_t> cases() const;
  [[nodiscard]] std::span<const std::uint8_t> cube_rows() const;

  bool operator==(const VolumeMesh& other) const;

 private:
  [[nodiscard]] std::size_t data_bytes() const;

  VolumeKey key_;
  std::uint16_t vertex_count_ = 0;
  std::uint16_t cube_count_ = 0;
  std::uint16_t triangle_count_ = 0;
  std::uint8_t touched_sides_ = 0;
  bool has_colors_ = false;
  std::shared_ptr<const std::byte[]> data_;  // fractions, normals, colours, cases, cube rows
};

/// Minimum distance (in 1/65536 voxel) of a vertex from both ends of its edge, so that different vertices
/// never coincide and no triangle is degenerate, even in float.
inline constexpr int kMinFraction = 64;

/// Colour of a vertex without colour at either end.
inline constexpr Rgb8 kNeutralColor{128, 128, 128};

/// Unit normal of an octahedral code (low byte u, high byte v, each signed in 1/127; Meyer et al. 2010, "On
/// floating-point normal vectors").
Eigen::Vector3f unpack_normal(std::uint16_t code);

/// Unpacks the mesh of one volume to metres, for viewers that draw volume by volume. Border vertices have the
/// same bits in every volume.
TriangleMesh unpack(const VolumeMesh& mesh, double voxel_size_m);

}  // namespace hm
