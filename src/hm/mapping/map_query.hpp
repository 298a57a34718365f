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

/// Queries of a map: distance, gradient, weight and colour at world points (dissertation 4.2), of a grid
/// owned elsewhere (DensePipeline::grid()) or of a file.
///
/// Thread safe while no thread changes the grid.
class MapQuery {
 public:
  /// Queries an existing grid, which must outlive this object.
  explicit MapQuery(const VolumeGrid& grid);
  /// Reads a map file (`.hmap`), or its volumes that intersect a box (world, metres). `max_bytes` limits the
  /// memory for voxels; 0: no limit. Errors: not found, not a map, damaged, kOutOfMemory.
  static Result<MapQuery> open(const std::filesystem::path& path, const std::optional<Box3>& region = {},
                               std::size_t max_bytes = 0);
  ~MapQuery();
  MapQuery(MapQuery&&) noexcept;
  MapQuery& operator=(MapQuery&&) noexcept;

  [[nodiscard]] GridSample at(const Vec3& p_world) const;
  /// The same for many points; `samples` must have the same length.
  void at(std::span<const Vec3> p_world, std::span<GridSample> samples,
          const ParallelLoop& loop = ParallelLoop()) const;

  [[nodiscard]] double voxel_size_m() const;
  /// Bounding box of all volumes (8 x 8 x 8 voxels), world, metres; empty for an empty map.
  [[nodiscard]] Box3 bounds() const;
  [[nodiscard]] std::size_t volume_count() const;
  /// Computes the coloured mesh from scratch.
  [[nodiscard]] TriangleMesh mesh(const ParallelLoop& loop = ParallelLoop()) const;

 private:
  explicit MapQuery(VolumeGrid&& grid);
  std::unique_ptr<VolumeGrid> own_;
  const VolumeGrid* grid_ = nullptr;
};

/// Writes a whole grid to a map file (`.hmap`, docs/file_formats.md), atomically. `program` is recorded in
/// it. Errors: the file cannot be written. To save a growing map repeatedly, use MapSaver (map_store.hpp), as
/// `hm reconstruct` does.
Result<void> save_map(const std::filesystem::path& path, VolumeGrid& grid,
                      const std::string& program = "housemartin");

}  // namespace hm
