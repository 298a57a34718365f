#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/geometry/box.hpp"
#include "hm/geometry/occupancy.hpp"
#include "hm/geometry/occupancy_grid_2d.hpp"
#include "hm/mvog/beam_scan.hpp"
#include "hm/mvog/mvog_params.hpp"

namespace hm {

/// Counters of a point: numbers of beams that ended there (hits) and passed (misses), up to the cap. Without
/// either, `assumed` is free if a beam brushed it, or occupied if one ended beside it.
struct Evidence {
  int hits = 0, misses = 0;
  Occupancy assumed = Occupancy::kUnknown;
  bool operator==(const Evidence&) const = default;
};

/// Result of casting a ray.
struct GridRayHit {
  Occupancy state = Occupancy::kFree;  ///< kOccupied, kUnknown if stopped by unknown space, kFree: no hit
  double distance_m = 0;               ///< to the cell's boundary, or the whole length
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();
};

enum class UnknownSpace { kPasses, kStops };

/// Changed part of the map: a square of columns over all heights.
struct ChangedTile {
  Eigen::Vector2d min_m = Eigen::Vector2d::Zero(), max_m = Eigen::Vector2d::Zero();
  std::uint64_t revision = 0;
};

/// Size of a map.
struct MvogSize {
  std::size_t bytes = 0;                                   ///< memory of the map, including reserves
  std::size_t working_bytes = 0;                           ///< additional working memory of insert()
  std::size_t tiles = 0;                                   ///< squares of columns
  std::size_t columns = 0;                                 ///< columns with at least one known volume
  std::size_t volumes_positive = 0, volumes_negative = 0;  ///< maximal occupied and free intervals
  std::size_t runs = 0;  ///< intervals of equal evidence, including unknown ones
  double area_m2 = 0;    ///< of the columns
};

/// Multi-volume occupancy grid (dissertation 2.5): a horizontal grid of columns, each a list of vertical
/// volumes. Unlike the published structure (`PublishedMvog`), a column is one list of runs with hit and miss
/// counters and boundaries at half cells; a scan counts once per level, and its hits override its misses;
/// counters are capped. Columns are stored in hashed tiles: the map grows in every direction, and the cost of
/// a scan depends on its beams only.
///
/// Const members may run concurrently while no thread changes the map. Equal scans in equal order give equal
/// bytes.
class MultiVolumeGrid {
 public:
  explicit MultiVolumeGrid(const MvogParams& params = {});
  ~MultiVolumeGrid();
  MultiVolumeGrid(MultiVolumeGrid&&) noexcept;
  MultiVolumeGrid& operator=(MultiVolumeGrid&&) noexcept;

  [[nodiscard]] const MvogParams& params() const;

  /// Inserts a scan (2.5.2). Unusable beams are skipped and counted.
  BeamScanStats insert(const BeamScan& scan);
  BeamScanStats insert(std::span<const Eigen::Vector3f> p_world_points,
                       const Eigen::Vector3d& p_world_origin);

  /// State of a point; unknown where not observed and outside the index range.
  [[nodiscard]] Occupancy at(const Eigen::Vector3d& p_world) const;
  [[nodiscard]] Evidence evidence_at(const Eigen::Vector3d& p_world) const;
  /// Probability of being occupied, hits / (hits + misses); nothing where unknown (2.5.3).
  [[nodiscard]] std::optional<double> probability_at(const Eigen::Vector3d& p_world) const;
  /// Casts a ray to the first occupied point. `to` must not be farther than 10 000 cells.
  [[nodiscard]] GridRayHit cast_ray(const Eigen::Vector3d& p_world_from, const Eigen::Vector3d& p_world_to,
                                    UnknownSpace unknown = UnknownSpace::kPasses) const;
  /// State of a box: occupied if any part of it is, else unknown if any part is, else free.
  [[nodiscard]] Occupancy in_box(const Box3& box_world) const;

  /// Known volumes of the column at (x, y), bottom to top; neighbours with the same state are merged.
  [[nodiscard]] std::vector<VerticalVolume> volumes_at(const Eigen::Vector2d& p_world) const;
  /// Highest probability of each column within [bottom_m, top_m] (Fig. 2.19), over the bounds of the map;
  /// unknown where nothing is known in this interval. kOutOfMemory when the map extends over more than 2^28
  /// cells.
  [[nodiscard]] Result<OccupancyGrid2D> slice(double bottom_m, double top_m) const;
  /// The same for a square of `side` cells a side; cell i covers [i, i + 1) times the resolution. The cost is
  /// that of the square.
  [[nodiscard]] OccupancyGrid2D slice_square(const Eigen::Vector2i& first_cell, int side, double bottom_m,
                                             double top_m) const;
  /// Known cubes of one cell, each with the highest probability of its two halves, sorted by column and
  /// height.
  [[nodiscard]] std::vector<OccupancyVoxel> voxels() const;
  /// Bounding box of the known space, metres; empty for an empty map.
  [[nodiscard]] Box3 bounds() const;

  /// Counter of insertions that changed the map.
  [[nodiscard]] std::uint64_t revision() const;
  /// Tiles that changed after a revision (0: all), latest first; the cost is proportional to the result.
  [[nodiscard]] std::vector<ChangedTile> changed_since(std::uint64_t revision) const;

  [[nodiscard]] MvogSize size() const;
  /// Memory of the map in bytes, including reserves: heap and object.
  [[nodiscard]] std::size_t bytes() const;
  /// How often the memory limit has kept insert() from updating a column, since this object was made.
  [[nodiscard]] std::size_t columns_refused() const;

  /// Converts the map to bytes (docs/file_formats.md) and back. Errors of damaged bytes name the offset.
  [[nodiscard]] std::vector<std::byte> serialise() const;
  static Result<MultiVolumeGrid> parse(std::span<const std::byte> bytes);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
