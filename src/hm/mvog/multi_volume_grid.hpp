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

/// The counters of a place: how often beams ended there and how often they passed, as far as remembered.
/// Where neither ever happened, but a beam brushed it or ended just beside it, `assumed` is free or occupied.
struct Evidence {
  int hits = 0, misses = 0;
  Occupancy assumed = Occupancy::kUnknown;
  bool operator==(const Evidence&) const = default;
};

/// Where a ray ended.
struct GridRayHit {
  Occupancy state =
      Occupancy::kFree;   ///< kOccupied, or kUnknown when unknown space stops it; kFree: nothing met
  double distance_m = 0;  ///< to the cell's wall, or the whole length
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();
};

enum class UnknownSpace { kPasses, kStops };

/// Part of the map that changed: a square of columns over all heights.
struct ChangedTile {
  Eigen::Vector2d min_m = Eigen::Vector2d::Zero(), max_m = Eigen::Vector2d::Zero();
  std::uint64_t revision = 0;
};

/// The size of a map.
struct MvogSize {
  std::size_t bytes = 0;          ///< everything that the map holds, reserves included
  std::size_t working_bytes = 0;  ///< besides: what insert() keeps from call to call
  std::size_t tiles = 0;          ///< squares of columns
  std::size_t columns = 0;        ///< columns with at least one known volume
  std::size_t volumes_positive = 0, volumes_negative = 0;  ///< greatest occupied and free stretches
  std::size_t runs = 0;  ///< stretches of equal evidence, unknown ones included
  double area_m2 = 0;    ///< of the columns
};

/// A multi-volume occupancy grid (dissertation 2.5): a horizontal grid of columns, each a list of vertical
/// volumes. Other than in the published structure (`MvogMap`), a column is one list of runs, each with hit
/// and miss counters, with walls at half cells; a scan counts once per place, and a hit outweighs the passing
/// beams of its own scan; and counters are capped. Columns live in tiles that are found by hashing: the map
/// grows in every direction, and the cost of a scan follows its beams only.
///
/// Not thread safe while it is changed; const members may run side by side. Equal scans in equal order give
/// equal bytes.
class MultiVolumeGrid {
 public:
  explicit MultiVolumeGrid(const MvogParams& params = {});
  ~MultiVolumeGrid();
  MultiVolumeGrid(MultiVolumeGrid&&) noexcept;
  MultiVolumeGrid& operator=(MultiVolumeGrid&&) noexcept;

  [[nodiscard]] const MvogParams& params() const;

  /// Writes a scan into the map (2.5.2). Beams that cannot be used are skipped and counted.
  BeamScanStats insert(const BeamScan& scan);
  BeamScanStats insert(std::span<const Eigen::Vector3f> p_world_points,
                       const Eigen::Vector3d& p_world_origin);

  /// The state of a point; unknown where nothing was seen and outside of what can be indexed.
  [[nodiscard]] Occupancy at(const Eigen::Vector3d& p_world) const;
  [[nodiscard]] Evidence evidence_at(const Eigen::Vector3d& p_world) const;
  /// hits / (hits + misses), nothing where unknown (2.5.3).
  [[nodiscard]] std::optional<double> probability_at(const Eigen::Vector3d& p_world) const;
  /// Follows a ray to the first occupied place. `to` must not be farther than 10 000 cells.
  [[nodiscard]] GridRayHit cast_ray(const Eigen::Vector3d& p_world_from, const Eigen::Vector3d& p_world_to,
                                    UnknownSpace unknown = UnknownSpace::kPasses) const;
  /// Occupied if anything inside of the box is, else unknown if any of it is, else free.
  [[nodiscard]] Occupancy in_box(const Box3& box_world) const;

  /// The known volumes of the column at (x, y), bottom to top, neighbours with the same state as one.
  [[nodiscard]] std::vector<VerticalVolume> volumes_at(const Eigen::Vector2d& p_world) const;
  /// The highest probability of each column within [bottom_m, top_m] (Fig. 2.19), around all columns known;
  /// unknown where the band holds nothing known. kOutOfMemory when the map spreads over more than 2^28 cells.
  [[nodiscard]] Result<OccupancyGrid2D> slice(double bottom_m, double top_m) const;
  /// Known cubes of one cell; a cube takes the highest probability of its two halves. Ordered by column and
  /// height, so that equal maps give equal lists.
  [[nodiscard]] std::vector<OccupancyVoxel> voxels() const;
  /// The box around everything known; empty for an empty map.
  [[nodiscard]] Box3 bounds() const;

  /// Counts up with every insertion that changed something.
  [[nodiscard]] std::uint64_t revision() const;
  /// The tiles that changed after that revision (0: all), latest first; costs as much as it returns.
  [[nodiscard]] std::vector<ChangedTile> changed_since(std::uint64_t revision) const;

  [[nodiscard]] MvogSize size() const;
  /// Bytes that the map holds, reserves included: heap and object.
  [[nodiscard]] std::size_t bytes() const;

  /// The map as bytes (docs/file_formats.md), and back. Damaged bytes are an error naming the offset.
  [[nodiscard]] std::vector<std::byte> serialise() const;
  static Result<MultiVolumeGrid> parse(std::span<const std::byte> bytes);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
