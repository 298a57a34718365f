#include "hm/mesh/incremental_mesher.hpp"

#include <algorithm>
#include <array>

#include "hm/core/stopwatch.hpp"
#include "hm/mesh/marching_cubes.hpp"
#include "hm/mesh/volume_index.hpp"
#include "hm/mesh/whole_mesh.hpp"

namespace hm {
namespace {

/// Volumes per range of the parallel loop; volumes meshed before the old meshes are replaced and, with a
/// budget, the time is checked.
constexpr std::size_t kGrain = 8, kBatch = 64, kBigBatch = 2048;
constexpr std::uint8_t kAllLayers = 63;

/// Neighbour of a changed volume that depends on it. The mesh of a volume reads voxels 0..8 on every axis for
/// its cubes, and for normals -1 and 9 on one axis at a time.
struct Neighbor {
  int d[3];
};
constexpr auto kDependents = [] {
  std::array<Neighbor, 19> all{};
  std::size_t count = 0;
  for (int z = -1; z <= 1; ++z)
    for (int y = -1; y <= 1; ++y)
      for (int x = -1; x <= 1; ++x)
        if ((x != 0 || y != 0 || z != 0) && (x > 0) + (y > 0) + (z > 0) <= 1) all[count++] = {{x, y, z}};
  return all;
}();

/// True if the mesh of the neighbour at d may change when border layers of a volume have changed.
/// `touched_sides` are those of the neighbour's present mesh.
bool depends(const Neighbor& neighbor, unsigned layers, unsigned touched_sides) {
  int outside = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const unsigned low = 1u << (2 * axis), high = low << 1u;
    const int d = neighbor.d[axis];
    if (d == 0 || (d < 0 && (layers & low))) continue;  // the neighbour's cubes read the low layer
    // Only normals at the neighbour's border reach further: up to our second layer, or to our high one.
    if (d > 0 && !(layers & high)) return false;
    if (!(touched_sides & (d < 0 ? high : low))) return false;
    ++outside;
  }
  return outside <= 1;
}

}  // namespace

struct IncrementalMesher::Impl {
  struct Entry {
    VolumeKey key;
    bool queued = false;
    bool gone = false;  ///< not in the grid at the last update
    VolumeMesh mesh;
  };

  MeshParams params;
  const ParallelLoop* loop;
  double voxel_size_m = 0;
  VolumeIndex index;
  std::vector<Entry> entries;
  std::vector<std::uint32_t> queue;  // entries, longest waiting first
  std::size_t vertices = 0, triangles = 0, mesh_bytes = 0;

  Impl(const MeshParams& p, const ParallelLoop& l) : params(p), loop(&l) {}

  void enqueue(VolumeKey key) {
    const auto number = index.find_or_add(key, static_cast<std::uint32_t>(entries.size()));
    if (number == entries.size()) entries.push_back({key, false, false, {}});
    enqueue_known(number);
  }
  void enqueue_known(std::uint32_t number) {
    if (entries[number].queued) return;
    entries[number].queued = true;
    queue.push_back(number);
  }
  void enqueue_dependents(const ChangedVolume& changed);
  void mesh_batch(const VolumeGrid& grid, std::span<const std::uint32_t> numbers, MeshUpdateStats& stats);
  void replace(Entry& entry, VolumeMesh mesh, MeshUpdateStats& stats);
  void forget_gone();
};

void IncrementalMesher::Impl::enqueue_dependents(const ChangedVolume& changed) {
  const unsigned layers = changed.released ? kAllLayers : changed.border_layers;
  for (const Neighbor& neighbor : kDependents) {
    const VolumeKey key{changed.key.x + neighbor.d[0], changed.key.y + neighbor.d[1],
                        changed.key.z + neighbor.d[2]};
    const std::uint32_t number = index.find(key);
    if (number != VolumeIndex::kNone && depends(neighbor, layers, entries[number].mesh.touched_sides()))
      enqueue_known(number);
  }
}

void IncrementalMesher::Impl::replace(Entry& entry, VolumeMesh mesh, MeshUpdateStats& stats) {
  if (!entry.mesh.empty() || !mesh.empty()) stats.updated.push_back(entry.key);
  vertices += mesh.vertex_count() - entry.mesh.vertex_count();
  triangles += mesh.triangle_count() - entry.mesh.triangle_count();
  mesh_bytes += mesh.bytes() - entry.mesh.bytes();
  stats.vertices_made += mesh.vertex_count();
  stats.triangles_made += mesh.triangle_count();
  ++stats.volumes_meshed;
  entry.mesh = std::move(mesh);
}

void IncrementalMesher::Impl::mesh_batch(const VolumeGrid& grid, std::span<const std::uint32_t> numbers,
                                         MeshUpdateStats& stats) {
  const std::uint16_t min_weight = min_voxel_weight(params);
  std::vector<VolumeMesh> meshes(numbers.size());
  std::vector<const Volume*> found(numbers.size());
  loop->for_ranges(numbers.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      found[i] = grid.find(entries[numbers[i]].key);
      if (found[i]) meshes[i] = mesh_volume(grid, *found[i], min_weight);
    }
  });
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    Entry& entry = entries[numbers[i]];
    entry.queued = false;
    entry.gone = found[i] == nullptr;
    replace(entry, std::move(meshes[i]), stats);
  }
}

void IncrementalMesher::Impl::forget_gone() {
  const std::size_t gone = static_cast<std::size_t>(
      std::count_if(entries.begin(), entries.end(), [](const Entry& e) { return e.gone; }));
  if (gone < 1024 || 2 * gone < entries.size()) return;
  std::vector<Entry> kept;
  std::vector<std::uint32_t> place(entries.size(), VolumeIndex::kNone);
  index.clear();
  for (std::size_t i = 0; i < entries.size(); ++i) {
    if (entries[i].gone && !entries[i].queued) continue;
    place[i] = index.find_or_add(entries[i].key, static_cast<std::uint32_t>(kept.size()));
    kept.push_back(std::move(entries[i]));
  }
  for (std::uint32_t& number : queue) number = place[number];
  entries = std::move(kept);
}

IncrementalMesher::IncrementalMesher(const MeshParams& params, const ParallelLoop& loop)
    : impl_(std::make_unique<Impl>(params, loop)) {}
IncrementalMesher::~IncrementalMesher() = default;
IncrementalMesher::IncrementalMesher(IncrementalMesher&&) noexcept = default;
IncrementalMesher& IncrementalMesher::operator=(IncrementalMesher&&) noexcept = default;

void IncrementalMesher::mark_changed(std::span<const ChangedVolume> changed) {
  // Registers all volumes first: a neighbour may be new in this scan.
  for (const ChangedVolume& volume : changed) impl_->enqueue(volume.key);
  for (const ChangedVolume& volume : changed) impl_->enqueue_dependents(volume);
}

void IncrementalMesher::mark_all(const VolumeGrid& grid) {
  for (const VolumeKey key : grid.sorted_keys()) impl_->enqueue(key);
  for (std::uint32_t number = 0; number < impl_->entries.size(); ++number) impl_->enqueue_known(number);
}

MeshUpdateStats IncrementalMesher::update(const VolumeGrid& grid, double budget_ms) {
  const Stopwatch clock;
  MeshUpdateStats stats;
  impl_->voxel_size_m = grid.voxel_size_m();
  const std::size_t batch = budget_ms > 0 ? kBatch : kBigBatch;
  std::size_t done = 0;
  while (done < impl_->queue.size() && (done == 0 || budget_ms <= 0 || clock.milliseconds() < budget_ms)) {
    const std::size_t count = std::min(batch, impl_->queue.size() - done);
    impl_->mesh_batch(grid, {impl_->queue.data() + done, count}, stats);
    done += count;
  }
  impl_->queue.erase(impl_->queue.begin(), impl_->queue.begin() + static_cast<std::ptrdiff_t>(done));
  impl_->forget_gone();
  std::sort(stats.updated.begin(), stats.updated.end(), ScanOrder());
  stats.volumes_waiting = impl_->queue.size();
  stats.update_ms = clock.milliseconds();
  return stats;
}

TriangleMesh IncrementalMesher::whole_mesh() const {
  return weld(volumes(), impl_->voxel_size_m, *impl_->loop);
}

const VolumeMesh* IncrementalMesher::find(VolumeKey key) const {
  const std::uint32_t number = impl_->index.find(key);
  if (number == VolumeIndex::kNone || impl_->entries[number].mesh.empty()) return nullptr;
  return &impl_->entries[number].mesh;
}

std::vector<const VolumeMesh*> IncrementalMesher::volumes() const {
  std::vector<const VolumeMesh*> result;
  for (const Impl::Entry& entry : impl_->entries)
    if (!entry.mesh.empty()) result.push_back(&entry.mesh);
  std::sort(result.begin(), result.end(),
            [](const VolumeMesh* a, const VolumeMesh* b) { return ScanOrder()(a->key(), b->key()); });
  return result;
}

double IncrementalMesher::voxel_size_m() const { return impl_->voxel_size_m; }
std::size_t IncrementalMesher::waiting() const { return impl_->queue.size(); }
std::size_t IncrementalMesher::vertex_count() const { return impl_->vertices; }
std::size_t IncrementalMesher::triangle_count() const { return impl_->triangles; }
std::size_t IncrementalMesher::bytes() const {
  return impl_->mesh_bytes + impl_->entries.capacity() * sizeof(Impl::Entry) + impl_->index.bytes() +
         impl_->queue.capacity() * sizeof(std::uint32_t);
}

}  // namespace hm
