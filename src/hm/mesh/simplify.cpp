#include "hm/mesh/simplify.hpp"

#include <meshoptimizer.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <unordered_map>
#include <utility>
#include <vector>

#include "hm/core/check.hpp"

namespace hm {
namespace {

constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();

/// Disjoint sets of vertices; the root of a set is its lowest vertex.
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0u); }
  std::uint32_t root(std::uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = root(a), b = root(b);
    if (a != b) parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> parent_;
};

template <class T>
void keep_entries(std::vector<T>& values, std::span<const std::uint32_t> place, std::size_t kept) {
  if (values.empty()) return;
  for (std::size_t i = 0; i < place.size(); ++i)
    if (place[i] != kUnused) values[place[i]] = values[i];  // never to a later place
  values.resize(kept);
  values.shrink_to_fit();
}

/// Removes unused vertices, preserving the order of the rest.
void drop_unused_vertices(TriangleMesh& mesh) {
  std::vector<std::uint32_t> place(mesh.vertices.size(), kUnused);
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t index : triangle) place[index] = 0;
  std::uint32_t kept = 0;
  for (std::uint32_t& p : place)
    if (p != kUnused) p = kept++;
  const bool normals = mesh.has_normals(), colors = mesh.has_colors();
  keep_entries(mesh.vertices, place, kept);
  if (normals) keep_entries(mesh.normals, place, kept);
  if (colors) keep_entries(mesh.colors, place, kept);
  for (auto& triangle : mesh.triangles)
    for (std::uint32_t& index : triangle) index = place[index];
}

/// Number of triangles and bounding box of a piece, stored at its root.
struct Piece {
  std::size_t triangles = 0;
  Eigen::AlignedBox3f box;
};

}  // namespace

TriangleMesh remove_small_pieces(TriangleMesh mesh, double min_size_m) {
  DisjointSets sets(mesh.vertices.size());
  for (const auto& t : mesh.triangles) sets.join(t[0], t[1]), sets.join(t[1], t[2]);
  std::vector<std::uint32_t> number(mesh.vertices.size(), kUnused);  // of the piece, at its root
  std::vector<Piece> pieces;
  for (const auto& t : mesh.triangles) {
    std::uint32_t& piece = number[sets.root(t[0])];
    if (piece == kUnused) {
      piece = static_cast<std::uint32_t>(pieces.size());
      pieces.emplace_back();
    }
    ++pieces[piece].triangles;
    for (const std::uint32_t index : t) pieces[piece].box.extend(mesh.vertices[index]);
  }
  std::size_t most = 0;
  for (const Piece& piece : pieces) most = std::max(most, piece.triangles);
  std::erase_if(mesh.triangles, [&](const auto& t) {
    const Piece& piece = pieces[number[sets.root(t[0])]];
    return piece.triangles < most && static_cast<double>(piece.box.diagonal().norm()) < min_size_m;
  });
  drop_unused_vertices(mesh);
  return mesh;
}

TriangleMesh simplify(TriangleMesh mesh, const SimplifyTarget& target) {
  HM_CHECK(target.keep_ratio >= 0 && target.max_error_m >= 0, "{} {}", target.keep_ratio, target.max_error_m);
  if (mesh.triangles.empty() || (target.keep_ratio >= 1 && target.max_error_m <= 0)) return mesh;
  static_assert(sizeof(Eigen::Vector3f) == 3 * sizeof(float) &&
                sizeof(mesh.triangles[0]) == 3 * sizeof(unsigned));
  const double wanted =
      target.keep_ratio >= 1 ? 0.0 : target.keep_ratio * static_cast<double>(mesh.triangles.size());
  const float* positions = mesh.vertices.front().data();
  const float scale = meshopt_simplifyScale(positions, mesh.vertices.size(), sizeof(Eigen::Vector3f));
  const float error = target.max_error_m > 0 && scale > 0 ? static_cast<float>(target.max_error_m) / scale
                                                          : std::numeric_limits<float>::max();
  std::vector<std::array<std::uint32_t, 3>> kept(mesh.triangles.size());
  const std::size_t indices =
      meshopt_simplify(kept.front().data(), mesh.triangles.front().data(), 3 * mesh.triangles.size(),
                       positions, mesh.vertices.size(), sizeof(Eigen::Vector3f),
                       3 * static_cast<std::size_t>(wanted), error, meshopt_SimplifyLockBorder, nullptr);
  kept.resize(indices / 3);
  kept.shrink_to_fit();
  mesh.triangles = std::move(kept);
  drop_unused_vertices(mesh);
  return mesh;
}

namespace {

/// Simplification needs about 100 bytes per triangle: a large mesh is done in pieces of this size.
constexpr std::size_t kPieceTriangles = 200'000;

/// Triangles `first` to `end` with the vertices that they use, without normals. `number` is scratch: kUnused
/// for every vertex of the mesh, before and after.
TriangleMesh piece_of(const TriangleMesh& mesh, std::size_t first, std::size_t end,
                      std::vector<std::uint32_t>& number) {
  TriangleMesh piece;
  std::vector<std::uint32_t> used;
  for (std::size_t i = first; i < end; ++i) {
    auto& triangle = piece.triangles.emplace_back(mesh.triangles[i]);
    for (std::uint32_t& index : triangle) {
      if (number[index] == kUnused) {
        number[index] = static_cast<std::uint32_t>(used.size());
        used.push_back(index);
      }
      index = number[index];
    }
  }
  for (const std::uint32_t vertex : used) {
    piece.vertices.push_back(mesh.vertices[vertex]);
    if (mesh.has_colors()) piece.colors.push_back(mesh.colors[vertex]);
    number[vertex] = kUnused;
  }
  return piece;
}

struct PositionHash {
  std::size_t operator()(const std::array<float, 3>& p) const {
    std::size_t hash = 0;
    for (const float value : p) hash = (hash ^ std::hash<float>()(value)) * 0x9E3779B97F4A7C15ull;
    return hash ^ (hash >> 29U);
  }
};

/// Simplifies consecutive triangles together. Vertices on the borders of pieces stay, and are merged by their
/// position; the next simplification removes them.
TriangleMesh simplified_pieces(const TriangleMesh& mesh, double keep_ratio) {
  TriangleMesh out;
  std::unordered_map<std::array<float, 3>, std::uint32_t, PositionHash> number;
  std::vector<std::uint32_t> scratch(mesh.vertices.size(), kUnused);
  for (std::size_t first = 0; first < mesh.triangles.size(); first += kPieceTriangles) {
    const std::size_t end = std::min(first + kPieceTriangles, mesh.triangles.size());
    const TriangleMesh piece = simplify(piece_of(mesh, first, end, scratch), {keep_ratio, 0});
    std::vector<std::uint32_t> place;
    for (std::size_t i = 0; i < piece.vertices.size(); ++i) {
      const auto& p = piece.vertices[i];
      const auto [entry, fresh] =
          number.try_emplace({p.x(), p.y(), p.z()}, static_cast<std::uint32_t>(out.vertices.size()));
      place.push_back(entry->second);
      if (!fresh) continue;
      out.vertices.push_back(p);
      if (piece.has_colors()) out.colors.push_back(piece.colors[i]);
    }
    for (const auto& t : piece.triangles) out.triangles.push_back({place[t[0]], place[t[1]], place[t[2]]});
  }
  return out;
}

}  // namespace

TriangleMesh cluster_vertices(const TriangleMesh& mesh, double cell_m) {
  HM_CHECK(cell_m > 0, "cell of {} m", cell_m);
  struct Cluster {
    Vec3 position = Vec3::Zero(), color = Vec3::Zero();
    double count = 0;
  };
  std::vector<Cluster> clusters;
  std::unordered_map<std::uint64_t, std::uint32_t> cluster_of_cell;
  std::vector<std::uint32_t> cluster(mesh.vertices.size(), kUnused);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Vec3 p = mesh.vertices[i].cast<double>(), cell = (p / cell_m).array().floor();
    if (!(cell.cwiseAbs().maxCoeff() < (1 << 20))) continue;
    std::uint64_t key = 0;
    for (int axis = 0; axis < 3; ++axis)
      key = (key << 21U) | static_cast<std::uint64_t>(static_cast<std::int64_t>(cell[axis]) + (1 << 20));
    const auto [place, fresh] = cluster_of_cell.try_emplace(key, static_cast<std::uint32_t>(clusters.size()));
    if (fresh) clusters.emplace_back();
    cluster[i] = place->second;
    Cluster& joined = clusters[place->second];
    joined.position += p;
    if (mesh.has_colors()) joined.color += Vec3(mesh.colors[i].r, mesh.colors[i].g, mesh.colors[i].b);
    joined.count += 1;
  }
  TriangleMesh out;
  for (const Cluster& joined : clusters) {
    out.vertices.push_back((joined.position / joined.count).cast<float>());
    if (!mesh.has_colors()) continue;
    const Vec3 color = joined.color / joined.count;
    const auto channel = [&](int k) { return static_cast<std::uint8_t>(std::lround(color[k])); };
    out.colors.push_back({channel(0), channel(1), channel(2)});
  }
  for (const auto& t : mesh.triangles) {
    const std::uint32_t a = cluster[t[0]], b = cluster[t[1]], c = cluster[t[2]];
    if (a == kUnused || b == kUnused || c == kUnused || a == b || b == c || c == a) continue;
    out.triangles.push_back({a, b, c});
  }
  drop_unused_vertices(out);
  return out;
}

TriangleMesh simplify_to(const TriangleMesh& mesh, std::size_t max_triangles) {
  HM_CHECK(max_triangles > 0, "no triangles");
  if (mesh.triangles.size() <= max_triangles) return mesh;
  TriangleMesh pieces;
  if (mesh.triangles.size() > 2 * kPieceTriangles && mesh.triangles.size() > 4 * max_triangles)
    pieces = simplified_pieces(
        mesh, 2.0 * static_cast<double>(max_triangles) / static_cast<double>(mesh.triangles.size()));
  const TriangleMesh& whole = pieces.triangles.empty() ? mesh : pieces;
  if (whole.triangles.size() <= max_triangles) return pieces;
  // Slightly fewer: the collapse of edges stops a little before or after.
  TriangleMesh small = simplify(
      whole, {0.98 * static_cast<double>(max_triangles) / static_cast<double>(whole.triangles.size()), 0});
  pieces = {};
  double cell_m = std::sqrt(surface_area(small) / static_cast<double>(max_triangles));
  while (small.triangles.size() > max_triangles) {
    small = cluster_vertices(small, std::max(cell_m, 1e-4));
    cell_m *= 1.25;
  }
  return small;
}

TriangleMesh clean_mesh(TriangleMesh mesh, const MeshParams& params) {
  if (params.min_piece_size_m > 0) mesh = remove_small_pieces(std::move(mesh), params.min_piece_size_m);
  return simplify(std::move(mesh), {params.simplify_keep_ratio, params.simplify_error_m});
}

}  // namespace hm
