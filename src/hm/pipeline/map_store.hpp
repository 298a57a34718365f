#pragma once
#include <future>
#include <memory>
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
  explicit MapSaver(MapFile file) : file_(std::make_unique<MapFile>(std::move(file))) {}
  ~MapSaver();
  MapSaver(MapSaver&&) noexcept = default;
  MapSaver& operator=(MapSaver&&) = delete;

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
  /// The same, but only copies the volumes now and writes them on another thread; the grid may change at
  /// once. An error of the writing is given by every later call of save(), begin_save() and wait():
  /// the file stays at the last good save.
  Result<void> begin_save(const VolumeGrid& grid, const MapHeader& header);
  /// Waits for what begin_save() began.
  Result<void> wait();

  [[nodiscard]] std::size_t pending() const { return pending_.size(); }
  /// Not while a save is under way.
  [[nodiscard]] const MapFile& file() const { return *file_; }

 private:
  std::unique_ptr<MapFile> file_;
  std::future<Result<void>> writing_;
  Result<void> outcome_;  ///< the first failure stays: what it left out is missing from the file
  std::set<VolumeKey> pending_, marks_;
};

}  // namespace hm
