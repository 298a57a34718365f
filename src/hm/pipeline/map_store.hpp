#pragma once
#include <optional>
#include <set>
#include <span>
#include <string>

#include "hm/geometry/box.hpp"
#include "hm/io/map_file.hpp"
#include "hm/tsdf/scan_stats.hpp"
#include "hm/tsdf/volume_grid.hpp"

namespace hm {

/// Which part of a map is loaded, and how much memory it may take (0: no cap).
struct MapLoadOptions {
  std::optional<Box3> region;  ///< world, metres; whole volumes that touch it are loaded
  std::size_t max_bytes = 0;
};

/// Reads the volumes of a map, or those of a region, into a new grid. Errors: as MapFile::for_each_block,
/// sizes that are not positive, kOutOfMemory when the cap does not suffice.
Result<VolumeGrid> load_grid(const MapFile& map, const MapLoadOptions& options = {});

/// The keys of the volumes that touch a box.
MapKeyBox key_box(const Box3& region, double volume_size_m);

/// Keeps a map file up to date with a growing grid: writes only what changed since the last save.
class MapSaver {
 public:
  explicit MapSaver(MapFile file) : file_(std::move(file)) {}

  /// Remembers what a scan changed.
  void note(std::span<const ChangedVolume> changed);
  /// The volumes whose interior mark (VolumeGrid::may_hold_interior) is not what load_grid() would set from
  /// their voxels. The mark may err on the safe side, and integration depends on it, so that a resumed run
  /// needs these: store them with the state, and hand them to restore_marks(). To be called before save().
  const std::set<VolumeKey>& marks_to_store(const VolumeGrid& grid);
  /// Sets the marks of a grid that was just loaded.
  void restore_marks(VolumeGrid& grid, std::span<const VolumeKey> stored);
  /// Writes the remembered volumes and the header in one transaction: after a kill at any moment the file
  /// holds either all of it or nothing of it.
  Result<void> save(const VolumeGrid& grid, const MapHeader& header);

  [[nodiscard]] std::size_t pending() const { return pending_.size(); }
  [[nodiscard]] const MapFile& file() const { return file_; }

 private:
  MapFile file_;
  std::set<VolumeKey> pending_, marks_;
};

}  // namespace hm
