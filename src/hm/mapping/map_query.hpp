#pragma once
#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "hm/core/parallel.hpp"
#include "hm/core/result.hpp"
#include "hm/geometry/box.hpp"
#include "hm/geometry/triangle_mesh.hpp"
#include "hm/tsdf/grid/grid_query.hpp"

namespace hm {

class VolumeGrid;

/// A map to ask: distance, gradient, weight and colour at points of the world (dissertation 4.2). Of a grid
/// that grows elsewhere (DensePipeline::grid()), or of a file.
///
/// Any number of threads may query, while none changes the grid.
class MapQuery {
 public:
  /// The grid must outlive it.
  explicit MapQuery(const VolumeGrid& grid);
  /// Reads a map file (`.hmap`), or the volumes of it that touch a box (world, metres). `max_bytes` caps the
  /// memory for voxels; 0: no cap. Errors: not there, not a map, damaged, kOutOfMemory.
  static Result<MapQuery> open(const std::filesystem::path& path, const std::optional<Box3>& region = {},
                               std::size_t max_bytes = 0);
  ~MapQuery();
  MapQuery(MapQuery&&) noexcept;
  MapQuery& operator=(MapQuery&&) noexcept;

  [[nodiscard]] GridSample at(const Vec3& p_world) const;
  /// Queries many points, at the same places of `samples` (as long).
  void at(std::span<const Vec3> p_world, std::span<GridSample> samples,
          const ParallelLoop& loop = ParallelLoop()) const;

  [[nodiscard]] double voxel_size_m() const;
  /// The box around all volumes (8 x 8 x 8 voxels), world, metres; empty for an empty map.
  [[nodiscard]] Box3 bounds() const;
  [[nodiscard]] std::size_t volume_count() const;
  /// The surface, coloured, from scratch.
  [[nodiscard]] TriangleMesh mesh(const ParallelLoop& loop = ParallelLoop()) const;

 private:
  explicit MapQuery(VolumeGrid&& grid);
  std::unique_ptr<VolumeGrid> own_;
  const VolumeGrid* grid_ = nullptr;
};

/// Writes a whole grid into a map file (`.hmap`, docs/file_formats.md). The file appears whole or not at all.
/// `program`: named in it. Errors: no place to write. For a map that is saved again and again while it grows
/// there is MapSaver (map_store.hpp), as `hm reconstruct` uses it.
Result<void> save_map(const std::filesystem::path& path, VolumeGrid& grid,
                      const std::string& program = "housemartin");

}  // namespace hm
