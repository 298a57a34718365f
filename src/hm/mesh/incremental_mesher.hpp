#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "hm/core/parallel.hpp"
#include "hm/geometry/triangle_mesh.hpp"
#include "hm/mesh/mesh_params.hpp"
#include "hm/mesh/volume_mesh.hpp"
#include "hm/tsdf/grid/volume_grid.hpp"
#include "hm/tsdf/projection/scan_stats.hpp"

namespace hm {

/// What one update did. Milliseconds.
struct MeshUpdateStats {
  std::size_t volumes_meshed = 0;   ///< looked at, with or without a surface
  std::size_t volumes_waiting = 0;  ///< left for later by the time budget
  std::size_t vertices_made = 0;    ///< in the volumes that were meshed
  std::size_t triangles_made = 0;
  double update_ms = 0;
  std::vector<VolumeKey> updated;  ///< volumes whose mesh was made, replaced or dropped, sorted by z, y, x
};

/// Keeps the mesh of a growing grid up to date by meshing only what changed (dissertation 4.4).
///
/// Not thread safe; update() itself is parallel and gives the same bits for any number of threads.
class IncrementalMesher {
 public:
  /// `loop` must outlive the mesher.
  IncrementalMesher(const MeshParams& params, const ParallelLoop& loop);
  ~IncrementalMesher();
  IncrementalMesher(IncrementalMesher&&) noexcept;
  IncrementalMesher& operator=(IncrementalMesher&&) noexcept;

  /// Queues every volume whose mesh depends on what changed: the volume, neighbours that share a changed
  /// border layer, and neighbours whose border normals read it.
  void mark_changed(std::span<const ChangedVolume> changed);
  /// Queues every volume of the grid (a map that was loaded) and every volume that has a mesh.
  void mark_all(const VolumeGrid& grid);

  /// Meshes what is queued, longest waiting first, until `budget_ms` is used up (0: everything). At least
  /// one batch is meshed per call, so that a queue always drains. Volumes that are gone lose their mesh.
  MeshUpdateStats update(const VolumeGrid& grid, double budget_ms = 0);

  /// The whole mesh as it stands, welded; valid at any moment. Not cleaned: see clean_mesh().
  [[nodiscard]] TriangleMesh whole_mesh() const;
  /// The mesh of one volume or nullptr; valid until the next update.
  [[nodiscard]] const VolumeMesh* find(VolumeKey key) const;
  /// All meshes that are not empty, sorted by z, y, x; valid until the next update.
  [[nodiscard]] std::vector<const VolumeMesh*> volumes() const;

  [[nodiscard]] std::size_t waiting() const;
  /// Sums over volumes: vertices on borders count once per volume that has them.
  [[nodiscard]] std::size_t vertex_count() const;
  [[nodiscard]] std::size_t triangle_count() const;
  /// Memory held for meshes, index and queue.
  [[nodiscard]] std::size_t bytes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
