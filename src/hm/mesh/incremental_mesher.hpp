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

/// Statistics of one update.
struct MeshUpdateStats {
  std::size_t volumes_meshed = 0;   ///< with or without a surface
  std::size_t volumes_waiting = 0;  ///< still queued because of the time budget
  std::size_t vertices_made = 0;    ///< in the meshed volumes
  std::size_t triangles_made = 0;
  double update_ms = 0;
  std::vector<VolumeKey> updated;  ///< volumes with a new, changed or removed mesh, sorted by z, y, x
};

/// Keeps the mesh of a growing grid up to date by meshing only changed volumes (dissertation 4.4).
///
/// Not thread safe; update() itself is parallel, with bit-identical results for any number of threads.
class IncrementalMesher {
 public:
  /// `loop` must outlive the mesher.
  IncrementalMesher(const MeshParams& params, const ParallelLoop& loop);
  ~IncrementalMesher();
  IncrementalMesher(IncrementalMesher&&) noexcept;
  IncrementalMesher& operator=(IncrementalMesher&&) noexcept;

  /// Queues every volume whose mesh depends on the changes: the volume itself, neighbours that share a
  /// changed border layer, and neighbours whose border normals read it.
  void mark_changed(std::span<const ChangedVolume> changed);
  /// Queues every volume of the grid (e.g. after loading a map) and every volume that has a mesh.
  void mark_all(const VolumeGrid& grid);

  /// Meshes queued volumes, longest waiting first, until `budget_ms` is used up (0: all). At least one batch
  /// is meshed per call, so that the queue always drains. Meshes of released volumes are removed.
  MeshUpdateStats update(const VolumeGrid& grid, double budget_ms = 0);

  /// Whole mesh in its current state, welded, metres; may be called at any time. Not cleaned: see
  /// clean_mesh().
  [[nodiscard]] TriangleMesh whole_mesh() const;
  /// Mesh of one volume or nullptr; valid until the next update.
  [[nodiscard]] const VolumeMesh* find(VolumeKey key) const;
  /// All non-empty meshes, sorted by z, y, x; valid until the next update.
  [[nodiscard]] std::vector<const VolumeMesh*> volumes() const;

  /// Voxel size of the grid at the last update; 0 before the first.
  [[nodiscard]] double voxel_size_m() const;
  [[nodiscard]] std::size_t waiting() const;
  /// Sums over volumes: border vertices count once per volume.
  [[nodiscard]] std::size_t vertex_count() const;
  [[nodiscard]] std::size_t triangle_count() const;
  /// Memory of meshes, index and queue in bytes.
  [[nodiscard]] std::size_t bytes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Sees a mesh change. Called on the mesher's thread, which it should hold up as little as it can.
class MeshObserver {
 public:
  virtual ~MeshObserver() = default;
  /// After an update: these volumes have another mesh, or none any more.
  virtual void on_mesh(const IncrementalMesher& mesher, std::span<const VolumeKey> updated) = 0;
  /// The mesh is complete; the mesher may be emptied after this.
  virtual void on_mesh_complete(const IncrementalMesher& mesher) = 0;
};

}  // namespace hm
