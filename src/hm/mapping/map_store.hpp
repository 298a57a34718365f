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

/// Part of a map to load, and the memory limit (0: none).
struct MapLoadOptions {
  std::optional<Box3> region;  ///< world, metres; loads all volumes that intersect it
  std::size_t max_bytes = 0;
};

/// Reads the volumes of a map, or of a region, into a new grid. Errors: those of MapFile::for_each_block,
/// sizes that are not positive, kOutOfMemory beyond the limit or the memory of the system.
Result<VolumeGrid> load_grid(const MapFile& map, const MapLoadOptions& options = {});

/// Keys of the volumes that intersect a box (world, metres).
MapKeyBox key_box(const Box3& region, double volume_size_m);

/// Keeps a map file up to date with a growing grid: writes only the changes since the last save, while the
/// grid changes. A save delays one frame by a few milliseconds and the following ones by about one, and holds
/// copies of at most some thousand volumes.
///
/// Must be called from the thread that changes the grid. Every save is one transaction: if the process is
/// killed, the file holds the last finished save.
class MapSaver {
 public:
  /// Creates the header to be saved with the volumes; called on another thread. `interior_marks`: volumes
  /// whose interior mark (VolumeGrid::may_hold_interior) differs from the one that load_grid() derives from
  /// their voxels. The mark is conservative and affects integration, so a resumed run needs it: store them
  /// with the state, and pass them to restore_marks().
  using MakeHeader = std::function<MapHeader(const std::set<VolumeKey>& interior_marks)>;

  explicit MapSaver(MapFile file);
  /// Discards an unfinished save.
  ~MapSaver();
  MapSaver(MapSaver&&) noexcept;
  MapSaver& operator=(MapSaver&&) = delete;

  /// Records the changes of a scan.
  void note(std::span<const ChangedVolume> changed);
  /// Restores the marks of a grid that was just loaded.
  void restore_marks(VolumeGrid& grid, std::span<const VolumeKey> stored);

  /// Starts saving the changed volumes in their current state (after finishing an earlier save). An error of
  /// an earlier save is returned by every later call: the file stays at the last successful save.
  /// kOutOfMemory if the copies do not fit into memory.
  Result<void> begin_save(VolumeGrid& grid, MakeHeader make_header);
  /// Passes more volumes to the writing thread, for about a millisecond; call after every scan.
  Result<void> continue_save(VolumeGrid& grid);
  /// Waits until a running save is on disk.
  Result<void> finish_save(VolumeGrid& grid);
  /// Saves and waits; the second form is for maps that are not continued later.
  Result<void> save(VolumeGrid& grid, MakeHeader make_header);
  Result<void> save(VolumeGrid& grid, const MapHeader& header);
  [[nodiscard]] bool saving() const;

  /// Closes the file, calls `move` to move it to `path`, and continues with it there. Not during a save.
  Result<void> move_file(const std::filesystem::path& path, const std::function<Result<void>()>& move);

  /// Number of volumes to be written by the next save.
  [[nodiscard]] std::size_t pending() const;
  /// Map file. Not during a save.
  [[nodiscard]] const MapFile& file() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
