#include "hm/pipeline/map_store.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include "hm/core/check.hpp"

namespace hm {
namespace {

static_assert(sizeof(TsdfVoxel) == 4 && sizeof(ColorVoxel) == 4 && kMapBlockVoxels == kVolumeVoxels);

bool holds_interior(const Volume& volume) {
  return std::any_of(volume.voxels, volume.voxels + kVolumeVoxels,
                     [](TsdfVoxel voxel) { return voxel.weight() > 0 && voxel.sdf() <= 0; });
}

/// Copies a block into the grid; false when the grid's memory cap forbids it.
bool insert(VolumeGrid& grid, const MapBlockView& block) {
  const VolumeKey key{block.key[0], block.key[1], block.key[2]};
  Volume* volume = grid.allocate(key);
  if (!volume) return false;
  for (std::size_t i = 0; i < kMapBlockVoxels; ++i) volume->voxels[i].bits = block.voxels[i];
  if (!block.colors.empty()) {
    if (!grid.allocate_colors(*volume)) return false;
    for (std::size_t i = 0; i < kMapBlockVoxels; ++i) volume->colors[i].bits = block.colors[i];
  }
  grid.set_may_hold_interior(key, holds_interior(*volume));
  return true;
}

/// A volume as the file wants it; the copies live in `buffer`.
MapBlockView view_of(const Volume& volume, std::uint32_t* buffer) {
  MapBlockView view{{volume.key.x, volume.key.y, volume.key.z}, {}, {}};
  std::memcpy(buffer, volume.voxels, kVolumeVoxels * sizeof(TsdfVoxel));
  view.voxels = {buffer, kMapBlockVoxels};
  if (volume.colors) {
    std::memcpy(buffer + kMapBlockVoxels, volume.colors, kVolumeVoxels * sizeof(ColorVoxel));
    view.colors = {buffer + kMapBlockVoxels, kMapBlockVoxels};
  }
  return view;
}

/// Volumes to write and to erase. The views point into the copies.
struct Changes {
  std::vector<std::uint32_t> copies;
  std::vector<MapBlockView> blocks;
  std::vector<MapBlockKey> gone;
};

Result<void> write(MapFile& file, const Changes& changes, const MapHeader& header) {
  if (const auto erased = file.erase(changes.gone); !erased) return erased;
  if (const auto put = file.put_blocks(changes.blocks); !put) return put;
  return file.commit(header);
}

}  // namespace

MapKeyBox key_box(const Box3& region, double volume_size_m) {
  MapKeyBox keys;
  for (int axis = 0; axis < 3; ++axis) {
    const auto low = std::floor(region.min()[axis] / volume_size_m);
    const auto high = std::floor(region.max()[axis] / volume_size_m);
    constexpr double kLimit = 1 << 30;
    keys.min[static_cast<std::size_t>(axis)] = static_cast<std::int32_t>(std::clamp(low, -kLimit, kLimit));
    keys.max[static_cast<std::size_t>(axis)] = static_cast<std::int32_t>(std::clamp(high, -kLimit, kLimit));
  }
  return keys;
}

Result<VolumeGrid> load_grid(const MapFile& map, const MapLoadOptions& options) {
  const MapHeader& header = map.header();
  const std::string path = map.path().string();
  if (!(header.voxel_size_m > 0) || !(header.sdf_unit_m > 0))
    return fail(ErrorCode::kCorrupted, path, "voxel size {} m and distance unit {} m are not positive",
                header.voxel_size_m, header.sdf_unit_m);
  VolumeGrid grid(header.voxel_size_m, header.sdf_unit_m);
  std::optional<MapKeyBox> box;
  if (options.region) box = key_box(*options.region, grid.volume_size_m());
  // A grid that grew to its cap may be a little larger after loading (order of its index): 2 % is allowed.
  const std::size_t limit = options.max_bytes + options.max_bytes / 50;
  bool fits = true;
  const auto read = map.for_each_block(box, [&](const MapBlockView& block) {
    fits = insert(grid, block) && (options.max_bytes == 0 || grid.map_bytes() <= limit);
    return fits;
  });
  if (!read) return forward_error(read);
  if (!fits)
    return fail(ErrorCode::kOutOfMemory, path, "its {} volumes do not fit into the memory cap of {:.0f} MB",
                map.block_count(), static_cast<double>(options.max_bytes) * 1e-6);
  grid.set_max_bytes(options.max_bytes);
  return grid;
}

void MapSaver::note(std::span<const ChangedVolume> changed) {
  for (const ChangedVolume& volume : changed) pending_.insert(volume.key);
}

const std::set<VolumeKey>& MapSaver::marks_to_store(const VolumeGrid& grid) {
  for (const VolumeKey& key : pending_) {
    const Volume* volume = grid.find(key);
    if (volume && grid.may_hold_interior(key) != holds_interior(*volume))
      marks_.insert(key);
    else
      marks_.erase(key);
  }
  return marks_;
}

void MapSaver::restore_marks(VolumeGrid& grid, std::span<const VolumeKey> stored) {
  for (const VolumeKey& key : stored)
    if (grid.find(key) && marks_.insert(key).second)
      grid.set_may_hold_interior(key, !grid.may_hold_interior(key));
}

MapSaver::~MapSaver() {
  if (writing_.valid()) writing_.wait();
}

Result<void> MapSaver::wait() {
  if (writing_.valid() && outcome_) outcome_ = writing_.get();
  return outcome_;
}

Result<void> MapSaver::save(const VolumeGrid& grid, const MapHeader& header) {
  if (const auto begun = begin_save(grid, header); !begun) return begun;
  return wait();
}

Result<void> MapSaver::begin_save(const VolumeGrid& grid, const MapHeader& header) {
  if (const auto earlier = wait(); !earlier) return earlier;
  Changes changes;
  changes.copies.resize(pending_.size() * 2 * kMapBlockVoxels);
  for (const VolumeKey& key : pending_) {
    if (const Volume* volume = grid.find(key))
      changes.blocks.push_back(
          view_of(*volume, changes.copies.data() + changes.blocks.size() * 2 * kMapBlockVoxels));
    else
      changes.gone.push_back({key.x, key.y, key.z});
  }
  pending_.clear();
  writing_ = std::async(std::launch::async, [file = file_.get(), header, kept = std::move(changes)] {
    return write(*file, kept, header);
  });
  return {};
}

}  // namespace hm
