#include "hm/mesh/whole_mesh.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

#include "hm/core/check.hpp"
#include "hm/mesh/cell_rows.hpp"
#include "hm/mesh/marching_cubes.hpp"
#include "hm/mesh/mesh_assembler.hpp"

namespace hm {
namespace {

constexpr std::size_t kWholeMeshGrain = 32;  // volumes per range
constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

/// Vertex on a far side (x, y or z = 8) of a volume: its edge, numbered in the order of vertices, and its
/// index among the vertices owned by the volume.
struct BorderVertex {
  std::uint16_t edge = 0;
  std::uint16_t rank = 0;
};
std::uint16_t edge_number(int axis, int row, int x) {
  return static_cast<std::uint16_t>((row * 3 + axis) * cells::kSide + x);
}

/// Welds volumes. A vertex shared by several volumes is owned by the first of them in ScanOrder. Its edge
/// lies on a far side of the owner towards any of the others, which come later. So it is sufficient to list
/// each volume's far vertices, by edge, and to search the lists of earlier neighbours.
class Welder {
 public:
  Welder(std::span<const VolumeMesh* const> volumes, double voxel_size_m, const ParallelLoop& loop)
      : volumes_(volumes), voxel_size_m_(voxel_size_m), loop_(loop), parts_(volumes.size()) {
    for (std::size_t i = 0; i < volumes.size(); ++i) {
      HM_CHECK(!volumes[i]->empty(), "volume {} has no mesh", i);
      HM_CHECK(i == 0 || ScanOrder()(volumes[i - 1]->key(), volumes[i]->key()), "volume {} is out of order",
               i);
    }
  }

  TriangleMesh run();

 private:
  struct Part {
    std::uint32_t first_vertex = 0, first_triangle = 0;
    std::uint32_t first_border = 0;  ///< in the list of its range
    std::uint16_t border_count = 0, owned = 0;
  };
  /// Indices of the earlier volumes that share an edge with a volume, by place_of(dx, dy, dz).
  class Earlier;

  template <class Body>
  void for_volumes(Body&& body) {
    loop_.for_ranges(volumes_.size(), kWholeMeshGrain,
                     [&](std::size_t begin, std::size_t end) { body(begin, end); });
  }
  [[nodiscard]] cells::Topology topology(std::size_t i) const {
    return {volumes_[i]->cube_rows(), volumes_[i]->cases()};
  }
  std::span<BorderVertex> border(std::size_t i) {
    return {borders_[i / kWholeMeshGrain].data() + parts_[i].first_border, parts_[i].border_count};
  }
  void list_borders(std::size_t begin, std::size_t end);
  void count_owned(std::size_t begin, std::size_t end);
  void place_parts(TriangleMesh& out);
  void write(std::size_t begin, std::size_t end, TriangleMesh& out);
  /// Earlier volume that owns a vertex, and the vertex's index in that volume's list of far vertices. (Not
  /// its rank, which other threads write at this stage.)
  struct Owner {
    std::size_t volume = kNone;  ///< kNone: no earlier volume contains it
    std::size_t place = 0;
  };
  Owner find_owner(Earlier& earlier, const VertexEdge& edge);

  std::span<const VolumeMesh* const> volumes_;
  double voxel_size_m_;
  const ParallelLoop& loop_;
  std::vector<Part> parts_;
  std::vector<std::vector<BorderVertex>> borders_;  // by range
};

class Welder::Earlier {
 public:
  static constexpr std::size_t kPlaces = 13;  // the first 13 of the 27 in scan order come before the middle
  static std::size_t place_of(int dx, int dy, int dz) {
    return static_cast<std::size_t>((dz + 1) * 9 + (dy + 1) * 3 + dx + 1);
  }

  explicit Earlier(std::span<const VolumeMesh* const> volumes) : volumes_(volumes) {}

  /// Moves to a volume, which must be later than in the previous call, so that the search is short.
  void move_to(std::size_t i) {
    const VolumeKey key = volumes_[i]->key();
    for (std::size_t place = 0; place < kPlaces; ++place) {
      const int p = static_cast<int>(place);
      const VolumeKey wanted{key.x + p % 3 - 1, key.y + p / 3 % 3 - 1, key.z + p / 9 - 1};
      std::size_t& at = cursor_[place];
      if (!started_) at = first_not_before(wanted, i);
      while (at < i && ScanOrder()(volumes_[at]->key(), wanted)) ++at;
      found_[place] = at < i && volumes_[at]->key() == wanted ? at : kNone;
    }
    started_ = true;
    next_ = {};
  }
  [[nodiscard]] std::size_t operator[](std::size_t place) const { return found_[place]; }
  /// Position in the neighbour's list up to which it has been searched. A volume's edge numbers differ from
  /// the neighbour's by a constant, so both are sorted.
  std::size_t& next_in(std::size_t place) { return next_[place]; }

 private:
  [[nodiscard]] std::size_t first_not_before(VolumeKey wanted, std::size_t end) const {
    const auto before = [](const VolumeMesh* mesh, VolumeKey key) { return ScanOrder()(mesh->key(), key); };
    const auto stop = volumes_.begin() + static_cast<std::ptrdiff_t>(end);
    return static_cast<std::size_t>(std::lower_bound(volumes_.begin(), stop, wanted, before) -
                                    volumes_.begin());
  }

  std::span<const VolumeMesh* const> volumes_;
  std::array<std::size_t, kPlaces> cursor_{}, found_{}, next_{};
  bool started_ = false;
};

/// Bit masks per row of edges: edges on a far side; and, per direction, edges on a near side that an earlier
/// volume may share.
struct BorderBits {
  std::array<unsigned, cells::kRows> far{};
  std::array<std::array<unsigned, cells::kRows>, 3> near{};
};
constexpr BorderBits kBorderBits = [] {
  constexpr unsigned kAll = (2u << kVolumeSide) - 1;
  BorderBits bits;
  for (int z = 0; z < cells::kSide; ++z)
    for (int y = 0; y < cells::kSide; ++y) {
      const auto row = static_cast<std::size_t>(cells::row_of(y, z));
      bits.far[row] = y == kVolumeSide || z == kVolumeSide ? kAll : 1u << kVolumeSide;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const bool all = (z == 0 && axis != 2) || (y == 0 && axis != 1);
        bits.near[axis][row] = all ? kAll : axis == 0 ? 0u : 1u;
      }
    }
  return bits;
}();
unsigned far_bits(int row) { return kBorderBits.far[static_cast<std::size_t>(row)]; }
unsigned near_bits(int axis, int row) {
  return kBorderBits.near[static_cast<std::size_t>(axis)][static_cast<std::size_t>(row)];
}

void Welder::list_borders(std::size_t begin, std::size_t end) {
  std::vector<BorderVertex>& list = borders_[begin / kWholeMeshGrain];
  for (std::size_t i = begin; i < end; ++i) {
    parts_[i].first_border = static_cast<std::uint32_t>(list.size());
    const cells::Topology cells = topology(i);
    for (int row = 0; row < cells::kRows; ++row)
      for (int axis = 0; axis < 3; ++axis)
        cells::for_each_bit(cells.edges.along[axis][row] & far_bits(row), [&](int x) {
          list.push_back({edge_number(axis, row, x), 0});
        });
    parts_[i].border_count = static_cast<std::uint16_t>(list.size() - parts_[i].first_border);
  }
}

Welder::Owner Welder::find_owner(Earlier& earlier, const VertexEdge& edge) {
  const int at[3] = {edge.x, edge.row % cells::kSide, edge.row / cells::kSide};
  int low[3], high[3];
  for (int i = 0; i < 3; ++i) {
    low[i] = i != edge.axis && at[i] == 0 ? -1 : 0;
    high[i] = i != edge.axis && at[i] == kVolumeSide ? 1 : 0;
  }
  for (int dz = low[2]; dz <= high[2]; ++dz)
    for (int dy = low[1]; dy <= high[1]; ++dy)
      for (int dx = low[0]; dx <= high[0]; ++dx) {
        const std::size_t place = Earlier::place_of(dx, dy, dz);
        if (place >= Earlier::kPlaces) return {};
        const std::size_t volume = earlier[place];
        if (volume == kNone) continue;
        const int row = cells::row_of(at[1] - kVolumeSide * dy, at[2] - kVolumeSide * dz);
        const std::uint16_t number = edge_number(edge.axis, row, at[0] - kVolumeSide * dx);
        const auto list = border(volume);
        std::size_t& next = earlier.next_in(place);
        while (next < list.size() && list[next].edge < number) ++next;
        if (next < list.size() && list[next].edge == number) return {volume, next};
      }
  return {};
}

/// Counts the vertices owned by each volume, and the ranks in the lists of far vertices. (The rank is unused
/// in a volume that does not own the vertex.)
void Welder::count_owned(std::size_t begin, std::size_t end) {
  Earlier earlier(volumes_);
  for (std::size_t i = begin; i < end; ++i) {
    earlier.move_to(i);
    const cells::Topology cells = topology(i);
    std::uint16_t owned = 0;
    auto far = border(i).begin();
    for (int row = 0; row < cells::kRows; ++row)
      for (int axis = 0; axis < 3; ++axis) {
        const unsigned edges = cells.edges.along[axis][row];
        if (edges == 0) continue;
        const unsigned shared = near_bits(axis, row), listed = far_bits(row);
        cells::for_each_bit(edges, [&](int x) {
          if (listed >> x & 1u) (far++)->rank = owned;
          if ((shared >> x & 1u) && find_owner(earlier, {axis, row, x}).volume != kNone) return;
          ++owned;
        });
      }
    parts_[i].owned = owned;
  }
}

void Welder::place_parts(TriangleMesh& out) {
  std::size_t vertices = 0, triangles = 0;
  bool colors = false;
  for (std::size_t i = 0; i < volumes_.size(); ++i) {
    parts_[i].first_vertex = static_cast<std::uint32_t>(vertices);
    parts_[i].first_triangle = static_cast<std::uint32_t>(triangles);
    vertices += parts_[i].owned;
    triangles += volumes_[i]->triangle_count();
    colors |= volumes_[i]->has_colors();
  }
  constexpr std::size_t kMost = std::numeric_limits<std::uint32_t>::max();
  HM_CHECK(vertices <= kMost && triangles <= kMost, "{} vertices, {} triangles", vertices, triangles);
  out.vertices.resize(vertices);
  out.normals.resize(vertices);
  out.colors.resize(colors ? vertices : 0);
  out.triangles.resize(triangles);
}

void Welder::write(std::size_t begin, std::size_t end, TriangleMesh& out) {
  Earlier earlier(volumes_);
  MeshAssembler assembler(out, voxel_size_m_);
  for (std::size_t i = begin; i < end; ++i) {
    earlier.move_to(i);
    assembler.begin(*volumes_[i]);
    const cells::Topology cells = topology(i);
    std::uint32_t next = parts_[i].first_vertex;
    std::size_t local = 0;
    for (int row = 0; row < cells::kRows; ++row)
      for (int axis = 0; axis < 3; ++axis) {
        const unsigned edges = cells.edges.along[axis][row];
        if (edges == 0) continue;
        const unsigned shared = near_bits(axis, row);
        cells::for_each_bit(edges, [&](int x) {
          const VertexEdge edge{axis, row, x};
          const Owner owner = shared >> x & 1u ? find_owner(earlier, edge) : Owner{};
          if (owner.volume != kNone)
            assembler.set_index(edge,
                                parts_[owner.volume].first_vertex + border(owner.volume)[owner.place].rank);
          else
            assembler.add_vertex(edge, local, next++);
          ++local;
        });
      }
    assembler.add_triangles(cells, parts_[i].first_triangle);
  }
}

TriangleMesh Welder::run() {
  TriangleMesh out;
  borders_.resize((volumes_.size() + kWholeMeshGrain - 1) / kWholeMeshGrain);
  for_volumes([&](std::size_t begin, std::size_t end) { list_borders(begin, end); });
  for_volumes([&](std::size_t begin, std::size_t end) { count_owned(begin, end); });
  place_parts(out);
  for_volumes([&](std::size_t begin, std::size_t end) { write(begin, end, out); });
  return out;
}

}  // namespace

TriangleMesh weld(std::span<const VolumeMesh* const> volumes, double voxel_size_m, const ParallelLoop& loop) {
  return Welder(volumes, voxel_size_m, loop).run();
}

TriangleMesh extract_mesh(const VolumeGrid& grid, const MeshParams& params, const ParallelLoop& loop) {
  const std::vector<VolumeKey> keys = grid.sorted_keys();
  const std::uint16_t min_weight = min_voxel_weight(params);
  std::vector<VolumeMesh> meshes(keys.size());
  loop.for_ranges(keys.size(), kWholeMeshGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) meshes[i] = mesh_volume(grid, *grid.find(keys[i]), min_weight);
  });
  std::vector<const VolumeMesh*> volumes;
  for (const VolumeMesh& mesh : meshes)
    if (!mesh.empty()) volumes.push_back(&mesh);
  return weld(volumes, grid.voxel_size_m(), loop);
}

}  // namespace hm
