#pragma once
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>

#include "hm/geometry/box.hpp"
#include "hm/io/map/map_file.hpp"
#include "hm/tsdf/grid/volume_grid.hpp"
#include "hm/tsdf/projection/scan_stats.hpp"

namespace hm {

/// The part of a map to load, and the memory it may take (0: no cap).
struct MapLoadOptions {
  std::optional<Box3> region;  ///< world, metres; whole volumes that touch it are loaded
  std::size_t max_bytes = 0;
};

/// Reads the volumes of a map, or those of a region, into a new grid. Errors: as MapFile::for_each_block,
/// sizes that are not positive, kOutOfMemory when the cap, or what the system has, does not suffice.
Result<VolumeGrid> load_grid(const MapFile& map, const MapLoadOptions& options = {});

/// The keys of the volumes that touch a box.
MapKeyBox key_box(const Box3& region, double volume_size_m);

/// Keeps a map file up to date with a growing grid: writes only what changed since the last save, while the
/// grid goes on changing. A save costs one frame a few milliseconds (what is about to change is copied first)
/// and those after it about one, and holds the copies of some thousand volumes at most.
///
/// One thread calls it, the one that changes the grid. Every save is one transaction: after a kill at any
/// moment the file holds the last save that was finished.
class MapSaver {
 public:
  /// Data saved with the volumes. `interior_marks`: the volumes whose interior mark
  /// (VolumeGrid::may_hold_interior) is not what load_grid() would set from their voxels. The mark may err on
  /// the safe side, and integration depends on it, so that a resumed run needs these: store them with the
  /// state, and hand them to restore_marks(). Called on another thread.
  using MakeHeader = std::function<MapHeader(const std::set<VolumeKey>& interior_marks)>;

  explicit MapSaver(MapFile file);
  /// Drops a save that is not finished.
  ~MapSaver();
  MapSaver(MapSaver&&) noexcept;
  MapSaver& operator=(MapSaver&&) = delete;

  /// Remembers what a scan changed.
  void note(std::span<const ChangedVolume> changed);
  /// Sets the marks of a grid that was just loaded.
  void restore_marks(VolumeGrid& grid, std::span<const VolumeKey> stored);

  /// Begins to save the remembered volumes as they are now (and finishes an earlier save, if it is still
  /// under way). An error is one of an earlier save, and is given by every later call: what was not written
  /// then is missing, and the file stays at the last good save. kOutOfMemory when the copies do not fit.
  Result<void> begin_save(VolumeGrid& grid, MakeHeader make_header);
  /// Hands some more volumes to the writing thread, about a millisecond's worth; to be called after every
  /// scan.
  Result<void> continue_save(VolumeGrid& grid);
  /// Waits until the save is on disk, if one is under way.
  Result<void> finish_save(VolumeGrid& grid);
  /// All of it; the second form for who does not go on with the map later.
  Result<void> save(VolumeGrid& grid, MakeHeader make_header);
  Result<void> save(VolumeGrid& grid, const MapHeader& header);
  [[nodiscard]] bool saving() const;

  /// Closes the file, has `move` move it to `path`, and goes on with it there. Not while a save is under way.
  Result<void> move_file(const std::filesystem::path& path, const std::function<Result<void>()>& move);

  /// Volumes that the next save is to write.
  [[nodiscard]] std::size_t pending() const;
  /// Not while a save is under way.
  [[nodiscard]] const MapFile& file() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
