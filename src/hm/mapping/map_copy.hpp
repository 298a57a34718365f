#pragma once
#include <filesystem>

#include "hm/mapping/map_store.hpp"

namespace hm {

/// Writes a complete snapshot of a growing map to a new file, on a separate thread while the grid changes.
/// Must be called from the thread that changes the grid; the grid must outlive it, and must not be exchanged
/// meanwhile.
class MapCopy {
 public:
  /// Creates the file and starts the snapshot; error when it cannot be written.
  static Result<MapCopy> begin(VolumeGrid& grid, const std::filesystem::path& path, const MapHeader& header);
  /// Cancels an incomplete copy; its file is then a map without volumes.
  ~MapCopy();
  MapCopy(MapCopy&& other) noexcept;
  MapCopy& operator=(MapCopy&&) = delete;

  /// Continues for about a millisecond; call after every frame. True: the file is complete and closed.
  Result<bool> go_on();

 private:
  MapCopy(VolumeGrid& grid, MapFile file) : grid_(&grid), saver_(std::in_place, std::move(file)) {}

  VolumeGrid* grid_;
  std::optional<MapSaver> saver_;
};

/// All volumes of a grid, marked as changed.
std::vector<ChangedVolume> all_volumes(const VolumeGrid& grid);

}  // namespace hm
