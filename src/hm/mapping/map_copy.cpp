#include "hm/mapping/map_copy.hpp"

#include <utility>

namespace hm {

std::vector<ChangedVolume> all_volumes(const VolumeGrid& grid) {
  constexpr std::uint8_t kAllLayers = 0x3f;
  std::vector<ChangedVolume> all;
  for (const VolumeKey& key : grid.sorted_keys()) all.push_back({key, kAllLayers, false});
  return all;
}

Result<MapCopy> MapCopy::begin(VolumeGrid& grid, const std::filesystem::path& path, const MapHeader& header) {
  auto file = MapFile::create(path, header);
  if (!file) return forward_error(file);
  MapCopy copy(grid, std::move(*file));
  copy.saver_->note(all_volumes(grid));
  const auto begun = copy.saver_->begin_save(grid, [header](const std::set<VolumeKey>&) { return header; });
  if (!begun) return forward_error(begun);
  return copy;
}

MapCopy::MapCopy(MapCopy&& other) noexcept
    : grid_(other.grid_), saver_(std::exchange(other.saver_, std::nullopt)) {}

MapCopy::~MapCopy() {
  if (saver_ && saver_->saving()) grid_->end_snapshot();
}

Result<bool> MapCopy::go_on() {
  if (const auto saved = saver_->continue_save(*grid_); !saved) return forward_error(saved);
  if (saver_->saving()) return false;
  saver_.reset();
  return true;
}

}  // namespace hm
