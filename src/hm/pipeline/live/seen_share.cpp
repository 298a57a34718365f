#include "hm/pipeline/live/seen_share.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace hm {
namespace {

constexpr int kBlockSide = 8;

VolumeKey cell_at(const Vec3& p_cells) {
  const auto index = [](double at) {
    return static_cast<std::int32_t>(std::floor(std::clamp(at, -1e9, 1e9)));
  };
  return {index(p_cells.x()), index(p_cells.y()), index(p_cells.z())};
}

VolumeKey block_of(VolumeKey cell) { return {cell.x >> 3, cell.y >> 3, cell.z >> 3}; }
std::size_t place_in_block(VolumeKey cell) {
  return static_cast<std::size_t>(((cell.z & 7) * kBlockSide + (cell.y & 7)) * kBlockSide + (cell.x & 7));
}

/// Evenly spread over the sphere: points of a spiral, each turned by the golden angle.
std::vector<Vec3> directions(std::size_t count) {
  const double golden_rad = std::numbers::pi * (3 - std::sqrt(5.0));
  std::vector<Vec3> all;
  for (std::size_t i = 0; i < count; ++i) {
    const double z = 1 - (2 * static_cast<double>(i) + 1) / static_cast<double>(count);
    const double radius = std::sqrt(1 - z * z), angle_rad = golden_rad * static_cast<double>(i);
    all.emplace_back(radius * std::cos(angle_rad), radius * std::sin(angle_rad), z);
  }
  return all;
}

}  // namespace

void SurfaceCells::mark(const TriangleMesh& mesh) {
  std::optional<VolumeKey> low, high;  // of the vertex before, which mostly lies in the same cubes
  for (const Eigen::Vector3f& vertex : mesh.vertices) {
    const Vec3 p_cells = vertex.cast<double>() / cell_m_;
    const VolumeKey first = cell_at(p_cells - Vec3::Constant(0.5)),
                    last = cell_at(p_cells + Vec3::Constant(0.5));
    if (first == low && last == high) continue;
    low = first, high = last;
    for (std::int32_t z = first.z; z <= last.z; ++z)
      for (std::int32_t y = first.y; y <= last.y; ++y)
        for (std::int32_t x = first.x; x <= last.x; ++x)
          blocks_[block_of({x, y, z})].set(place_in_block({x, y, z}));
  }
}

void SurfaceCells::add(const SurfaceCells& other) {
  for (const auto& [key, block] : other.blocks_) blocks_[key] |= block;
}

bool SurfaceCells::is_hit(const Vec3& from_m, const Vec3& direction, double reach_m) const {
  const Vec3 from = from_m / cell_m_;
  const auto steps = static_cast<int>(2 * reach_m / cell_m_);
  const Block* block = nullptr;
  std::optional<VolumeKey> at;
  for (int i = 0; i <= steps; ++i) {
    const VolumeKey cell = cell_at(from + (0.5 * i) * direction);
    if (const VolumeKey key = block_of(cell); key != at) {
      at = key;
      const auto found = blocks_.find(key);
      block = found == blocks_.end() ? nullptr : &found->second;
    }
    if (block && block->test(place_in_block(cell))) return true;
  }
  return false;
}

std::vector<Vec3> places_along(std::span<const Eigen::Vector3f> path_m, double spacing_m, std::size_t most) {
  std::vector<Vec3> places;
  const auto is_near = [&](const Vec3& point) {
    return std::any_of(places.begin(), places.end(),
                       [&](const Vec3& place) { return (place - point).norm() < spacing_m; });
  };
  for (const Eigen::Vector3f& point : path_m) {
    if (is_near(point.cast<double>())) continue;
    if (places.size() == most) return places_along(path_m, 2 * spacing_m, most);
    places.push_back(point.cast<double>());
  }
  return places;
}

void SeenShare::set_page(VolumeKey page, const TriangleMesh& mesh, double voxel_size_m) {
  SurfaceCells cells(voxel_size_m);
  cells.mark(mesh);
  const std::lock_guard lock(mutex_);
  if (mesh.vertices.empty())
    cells_.erase(page);
  else
    cells_.insert_or_assign(page, std::move(cells));
}

void SeenShare::count(std::vector<Eigen::Vector3f> path_m) {
  jobs_.give(0, [this, path = std::move(path_m)] {
    std::optional<SurfaceCells> surface;
    {
      const std::lock_guard lock(mutex_);
      if (!cells_.empty()) surface = cells_.begin()->second;
      for (const auto& [page, cells] : cells_) surface->add(cells);
    }
    const std::vector<Vec3> places = places_along(path, kSpacing_m, kMostPlaces),
                            around = directions(kDirections);
    std::size_t hits = 0;
    for (const Vec3& place : places)
      for (const Vec3& direction : around)
        if (surface && surface->is_hit(place, direction, kReach_m)) ++hits;
    const std::lock_guard lock(mutex_);
    share_.reset();
    if (surface && !places.empty())
      share_ = static_cast<double>(hits) / static_cast<double>(places.size() * around.size());
  });
}

std::optional<double> SeenShare::share() const {
  const std::lock_guard lock(mutex_);
  return share_;
}

}  // namespace hm
