#pragma once
#include <filesystem>

#include "hm/mapping/map_store.hpp"

namespace hm {

/// Writes all of a growing map, as it is at one moment, into a new file, on a thread of its own while the
/// grid goes on changing. One thread calls it, the one that changes the grid; the grid must outlive it, and
/// must not be exchanged for another one meanwhile.
class MapCopy {
 public:
  /// Makes the file; an error when the place cannot be written.
  static Result<MapCopy> begin(VolumeGrid& grid, const std::filesystem::path& path, const MapHeader& header);
  /// Gives up a copy that is not complete; its file is then a map without volumes.
  ~MapCopy();
  MapCopy(MapCopy&& other) noexcept;
  MapCopy& operator=(MapCopy&&) = delete;

  /// Goes on for about a millisecond; to be called after every frame. True: the file is complete and closed.
  Result<bool> go_on();

 private:
  MapCopy(VolumeGrid& grid, MapFile file) : grid_(&grid), saver_(std::in_place, std::move(file)) {}

  VolumeGrid* grid_;
  std::optional<MapSaver> saver_;
};

/// Every volume of a grid, as if it had changed.
std::vector<ChangedVolume> all_volumes(const VolumeGrid& grid);

}  // namespace hm
