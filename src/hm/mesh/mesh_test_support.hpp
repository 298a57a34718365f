#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <vector>

#include "hm/core/rng.hpp"
#include "hm/mesh/cube_table.hpp"
#include "hm/mesh/volume_mesh.hpp"
#include "hm/tsdf/grid/volume_grid.hpp"

/// Test support: grids filled from functions or noise, and a slow, simple reference mesher.
namespace hm::testing {

using Lattice = std::array<int, 3>;  ///< a voxel's world index

inline Lattice step(Lattice at, int axis, int by = 1) {
  at[static_cast<std::size_t>(axis)] += by;
  return at;
}
inline VolumeKey key_of(Lattice at) { return {at[0] >> 3, at[1] >> 3, at[2] >> 3}; }
inline std::size_t offset_of(Lattice at) {
  return static_cast<std::size_t>(voxel_offset(at[0] & 7, at[1] & 7, at[2] & 7));
}

inline TsdfVoxel voxel_at(const VolumeGrid& grid, Lattice at) {
  const Volume* volume = grid.find(key_of(at));
  return volume ? volume->voxels[offset_of(at)] : TsdfVoxel{};
}
inline ColorVoxel color_at(const VolumeGrid& grid, Lattice at) {
  const Volume* volume = grid.find(key_of(at));
  return volume && volume->colors ? volume->colors[offset_of(at)] : ColorVoxel{};
}
inline void set_voxel(VolumeGrid& grid, Lattice at, TsdfVoxel voxel) {
  grid.allocate(key_of(at))->voxels[offset_of(at)] = voxel;
}
inline void set_color(VolumeGrid& grid, Lattice at, ColorVoxel color) {
  Volume* volume = grid.allocate(key_of(at));
  grid.allocate_colors(*volume);
  volume->colors[offset_of(at)] = color;
}

/// Calls body for every voxel of the cube [low, high)^3.
template <class Body>
void for_each_voxel(int low, int high, Body&& body) {
  for (int z = low; z < high; ++z)
    for (int y = low; y < high; ++y)
      for (int x = low; x < high; ++x) body(Lattice{x, y, z});
}

/// Sets the voxels of the cube [low, high)^3 to a distance in metres at their centres.
inline void fill(VolumeGrid& grid, int low, int high, const std::function<double(const Vec3&)>& distance_m) {
  for_each_voxel(low, high, [&](Lattice at) {
    const Vec3 center = (Vec3(at[0], at[1], at[2]) + Vec3::Constant(0.5)) * grid.voxel_size_m();
    const double units = std::clamp(std::round(distance_m(center) / grid.sdf_unit_m()), -32767.0, 32767.0);
    set_voxel(grid, at, TsdfVoxel::make(static_cast<std::int16_t>(units), kWeightOne));
  });
}

/// Random voxels: distances of any size (small ones and the extremes more often), a share of them unknown,
/// weights from 1 up; colours for a share of the voxels.
struct Noise {
  int low = -9, high = 13;
  double unknown_ratio = 0.02;
  double color_ratio = 0.7;
};
inline void fill_noise(VolumeGrid& grid, Rng& rng, const Noise& noise) {
  for_each_voxel(noise.low, noise.high, [&](Lattice at) {
    const int scale = 1 << rng.below(16);
    auto sdf =
        static_cast<std::int16_t>(static_cast<int>(rng.below(static_cast<std::uint32_t>(2 * scale))) - scale);
    if (rng.below(50) == 0) sdf = std::array<std::int16_t, 4>{-32768, -32767, 32767, 0}[rng.below(4)];
    const bool unknown = rng.uniform() < noise.unknown_ratio;
    set_voxel(grid, at,
              unknown ? TsdfVoxel{} : TsdfVoxel::make(sdf, static_cast<std::uint16_t>(1 + rng.below(600))));
    if (rng.uniform() < noise.color_ratio) set_color(grid, at, ColorVoxel{rng.next_u32()});
  });
}

struct ReferenceVertex {
  std::uint16_t fraction = 0, normal = 0;
  Rgb8 color;
};
struct EdgeId {
  Lattice low{};
  int axis = 0;
  /// Order of vertices in a volume.
  bool operator<(const EdgeId& o) const {
    return std::array{low[2], low[1], axis, low[0]} < std::array{o.low[2], o.low[1], o.axis, o.low[0]};
  }
  bool operator==(const EdgeId&) const = default;
};
struct ReferenceMesh {
  std::map<EdgeId, ReferenceVertex> vertices;
  std::vector<std::array<EdgeId, 3>> triangles;
};

class ReferenceMesher {
 public:
  ReferenceMesher(const VolumeGrid& grid, int min_weight) : grid_(grid), min_weight_(min_weight) {}

  [[nodiscard]] ReferenceMesh mesh(VolumeKey key) const {
    ReferenceMesh out;
    for (int z = 0; z < 8; ++z)
      for (int y = 0; y < 8; ++y)
        for (int x = 0; x < 8; ++x) mesh_cube({8 * key.x + x, 8 * key.y + y, 8 * key.z + z}, out);
    return out;
  }

 private:
  [[nodiscard]] bool known(Lattice at) const { return voxel_at(grid_, at).weight() >= min_weight_; }
  [[nodiscard]] int distance(Lattice at) const { return std::max<int>(voxel_at(grid_, at).sdf(), -32767); }

  void mesh_cube(Lattice low, ReferenceMesh& out) const {
    std::size_t cube = 0;
    for (int corner = 0; corner < 8; ++corner) {
      const Lattice at{low[0] + (corner & 1), low[1] + (corner >> 1 & 1), low[2] + (corner >> 2)};
      if (!known(at)) return;
      if (distance(at) < 0) cube |= std::size_t{1} << corner;
    }
    for (std::size_t t = 0; t < cube_table().triangle_count[cube]; ++t) {
      std::array<EdgeId, 3> triangle;
      for (std::size_t k = 0; k < 3; ++k) {
        const CubeEdge edge = cube_edge(cube_table().edges[cube][3 * t + k]);
        triangle[k] = {{low[0] + edge.low[0], low[1] + edge.low[1], low[2] + edge.low[2]}, edge.axis};
        out.vertices.try_emplace(triangle[k], make_vertex(triangle[k]));
      }
      out.triangles.push_back(triangle);
    }
  }

  [[nodiscard]] static int saturate(int value) { return std::clamp(value, -32768, 32767); }

  [[nodiscard]] std::array<float, 3> gradient(Lattice at) const {
    std::array<float, 3> result{};
    for (int axis = 0; axis < 3; ++axis) {
      const Lattice before = step(at, axis, -1), after = step(at, axis);
      const int high = known(after) ? distance(after) : distance(at);
      const int low = known(before) ? distance(before) : distance(at);
      int difference = saturate(high - low);
      if (!known(after) || !known(before)) difference = saturate(2 * difference);
      result[static_cast<std::size_t>(axis)] = static_cast<float>(difference);
    }
    return result;
  }

  [[nodiscard]] static std::uint16_t octahedral(float x, float y, float z) {
    float length = std::abs(x) + std::abs(y) + std::abs(z);
    if (length == 0) length = 1;
    const float scale = 127.0F / length;
    float u = x * scale, v = y * scale;
    if (z < 0) {
      const float folded = std::copysign(127.0F - std::abs(v), u);
      v = std::copysign(127.0F - std::abs(u), v);
      u = folded;
    }
    const int a = static_cast<int>(std::nearbyint(u)), b = static_cast<int>(std::nearbyint(v));
    return static_cast<std::uint16_t>((a & 0xff) | (b & 0xff) << 8);
  }

  [[nodiscard]] static Rgb8 blend(ColorVoxel a, ColorVoxel b, int t) {
    if (a.weight() == 0 && b.weight() == 0) return kNeutralColor;
    if (a.weight() == 0) a = b;
    if (b.weight() == 0) b = a;
    const auto mix = [&](int p, int q) {
      return static_cast<std::uint8_t>((p * (256 - t) + q * t + 128) / 256);
    };
    return {mix(a.r(), b.r()), mix(a.g(), b.g()), mix(a.b(), b.b())};
  }

  [[nodiscard]] ReferenceVertex make_vertex(const EdgeId& edge) const {
    const Lattice a = edge.low, b = step(a, edge.axis);
    const auto fa = static_cast<float>(distance(a)), fb = static_cast<float>(distance(b));
    const int exact = static_cast<int>(std::nearbyint(fa / (fa - fb) * 65536.0F));
    const int fraction = std::clamp(exact, kMinFraction, 65536 - kMinFraction);
    const float t = static_cast<float>(fraction) * (1.0F / 65536.0F);
    const auto ga = gradient(a), gb = gradient(b);
    std::array<float, 3> g{};
    for (std::size_t i = 0; i < 3; ++i) g[i] = ga[i] + (gb[i] - ga[i]) * t;
    return {static_cast<std::uint16_t>(fraction), octahedral(g[0], g[1], g[2]),
            blend(color_at(grid_, a), color_at(grid_, b), fraction >> 8)};
  }

  const VolumeGrid& grid_;
  int min_weight_;
};

}  // namespace hm::testing
