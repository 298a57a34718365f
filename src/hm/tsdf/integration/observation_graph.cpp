#include "hm/tsdf/integration/observation_graph.hpp"

#include <algorithm>
#include <tuple>
#include <unordered_map>

#include "hm/tsdf/integration/ray_walk.hpp"

namespace hm {
namespace {

struct KeyHash {
  std::size_t operator()(VolumeKey k) const {
    return static_cast<std::size_t>(k.x * 73856093) ^ static_cast<std::size_t>(k.y * 19349663) ^
           static_cast<std::size_t>(k.z * 83492791);
  }
};

auto order(VolumeKey k) { return std::tuple(k.z, k.y, k.x); }

}  // namespace

struct ObservationGraph::Part {
  struct Edge {
    std::uint32_t slot;  ///< of the part's own volumes
    std::uint32_t ray;
  };
  std::unordered_map<VolumeKey, std::uint32_t, KeyHash> slots;
  std::vector<VolumeKey> keys;
  std::vector<std::uint8_t> hit;
  std::vector<Edge> edges;
  std::uint32_t last_slot = 0;

  /// Neighbouring rays cross the same volumes: the last one is tried first.
  std::uint32_t slot_of(VolumeKey key) {
    if (last_slot < keys.size() && keys[last_slot] == key) return last_slot;
    const auto [found, is_new] = slots.try_emplace(key, static_cast<std::uint32_t>(keys.size()));
    if (is_new) {
      keys.push_back(key);
      hit.push_back(0);
    }
    return last_slot = found->second;
  }
};

void ObservationGraph::build(const VolumeGrid& grid, std::span<const ObservedRay> rays, const Span& span,
                             const ParallelLoop& loop) {
  constexpr std::size_t kRaysPerPart = 4096;
  std::vector<Part> parts((rays.size() + kRaysPerPart - 1) / kRaysPerPart);
  const double volume_size = grid.volume_size_m(), slack_m = grid.voxel_size_m();
  loop.for_ranges(rays.size(), kRaysPerPart, [&](std::size_t begin, std::size_t end) {
    Part& part = parts[begin / kRaysPerPart];
    for (std::size_t i = begin; i < end; ++i) {
      const ObservedRay& ray = rays[i];
      // A voxel's centre may lie up to its half diagonal before its crossing: hence the slack.
      const double band_begin = ray.length_m - ray.tau_m - slack_m;
      const double t_begin = span.carving ? 0.0 : std::max(ray.length_m - ray.tau_m, 0.0);
      const CellRay cells{span.p_world_origin / volume_size, ray.direction / volume_size};
      walk_cells(cells, t_begin, ray.length_m + ray.tau_m, [&](const Eigen::Vector3i& cell, double t_exit) {
        const VolumeKey key{cell.x(), cell.y(), cell.z()};
        const bool hit = t_exit >= band_begin;
        if (!hit && !grid.may_hold_interior(key)) return;
        const std::uint32_t slot = part.slot_of(key);
        part.hit[slot] = static_cast<std::uint8_t>(part.hit[slot] | (hit ? 1 : 0));
        part.edges.push_back({slot, static_cast<std::uint32_t>(i)});
      });
    }
  });
  merge(parts);
}

/// Counting sort of all edges by volume; within a volume they stay in the order of the rays.
void ObservationGraph::merge(std::vector<Part>& parts) {
  volumes_.clear();
  for (const Part& part : parts) volumes_.insert(volumes_.end(), part.keys.begin(), part.keys.end());
  std::sort(volumes_.begin(), volumes_.end(), [](VolumeKey a, VolumeKey b) { return order(a) < order(b); });
  volumes_.erase(std::unique(volumes_.begin(), volumes_.end()), volumes_.end());
  hit_.assign(volumes_.size(), 0);
  begin_.assign(volumes_.size() + 1, 0);
  std::vector<std::vector<std::uint32_t>> place(parts.size());  // part's slot -> volume
  for (std::size_t p = 0; p < parts.size(); ++p) {
    for (std::size_t slot = 0; slot < parts[p].keys.size(); ++slot) {
      const auto found = std::lower_bound(volumes_.begin(), volumes_.end(), parts[p].keys[slot],
                                          [](VolumeKey a, VolumeKey b) { return order(a) < order(b); });
      place[p].push_back(static_cast<std::uint32_t>(found - volumes_.begin()));
      hit_[place[p].back()] = static_cast<std::uint8_t>(hit_[place[p].back()] | parts[p].hit[slot]);
    }
    for (const Part::Edge& edge : parts[p].edges) ++begin_[place[p][edge.slot] + 1];
  }
  for (std::size_t v = 0; v < volumes_.size(); ++v) begin_[v + 1] += begin_[v];
  observations_.resize(begin_.back());
  std::vector<std::uint32_t> next(begin_.begin(), begin_.end() - 1);
  for (std::size_t p = 0; p < parts.size(); ++p)
    for (const Part::Edge& edge : parts[p].edges) observations_[next[place[p][edge.slot]]++] = edge.ray;
}

}  // namespace hm
