#include "hm/mapping/map_store.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "hm/core/check.hpp"
#include "hm/core/stopwatch.hpp"
#include "hm/core/text/counted.hpp"
#include "hm/mapping/map_writer.hpp"

namespace hm {
namespace {

static_assert(sizeof(TsdfVoxel) == 4 && sizeof(ColorVoxel) == 4 && kMapBlockVoxels == kVolumeVoxels);

bool holds_interior(const Volume& volume) {
  return std::any_of(volume.voxels, volume.voxels + kVolumeVoxels,
                     [](TsdfVoxel voxel) { return voxel.weight() > 0 && voxel.sdf() <= 0; });
}

/// Copies a block into the grid; false when the grid's memory limit is reached.
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
  grid.pack(key);  // until it is needed
  return true;
}

/// Limit of volumes waiting to be written, and number copied between checks of the time.
constexpr std::size_t kMostWaiting = 4096, kBatch = 64;
constexpr double kContinue_ms = 1.0;

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
    fits = insert(grid, block) && (options.max_bytes == 0 || grid.unpacked_bytes() <= limit);
    return fits;
  });
  if (!read) return forward_error(read);
  if (!fits)
    return fail(ErrorCode::kOutOfMemory, path, "its {} do not fit into the memory cap of {:.0f} MB",
                counted(map.block_count(), "block"), static_cast<double>(options.max_bytes) * 1e-6);
  grid.set_max_bytes(options.max_bytes);
  return grid;
}

struct MapSaver::Impl {
  explicit Impl(MapFile map_file) : file(std::move(map_file)) {}

  MapFile file;
  std::set<VolumeKey> marks;  ///< owned by the writer while there is one
  VolumesByPage pending;
  Result<void> outcome;  ///< the first failure is kept, since its data is missing in the file
  std::unique_ptr<MapWriter> writer;

  void hand_over(VolumeGrid& grid) {
    writer->add(grid.take_snapshot(kBatch));
    if (!grid.snapshot_under_way()) writer->close();
  }
};

MapSaver::MapSaver(MapFile file) : impl_(std::make_unique<Impl>(std::move(file))) {}
MapSaver::~MapSaver() = default;
MapSaver::MapSaver(MapSaver&&) noexcept = default;

const MapFile& MapSaver::file() const { return impl_->file; }
bool MapSaver::saving() const { return impl_->writer != nullptr; }

std::size_t MapSaver::pending() const {
  std::size_t count = 0;
  for (const auto& [page, volumes] : impl_->pending)
    count += static_cast<std::size_t>(std::popcount(volumes));
  return count;
}

void MapSaver::note(std::span<const ChangedVolume> changed) {
  auto page = impl_->pending.end();
  for (const ChangedVolume& volume : changed) {
    // Neighbours follow each other.
    if (page == impl_->pending.end() || page->first != page_of(volume.key))
      page = impl_->pending.try_emplace(page_of(volume.key), 0).first;
    page->second |= place_bit(volume.key);
  }
}

void MapSaver::restore_marks(VolumeGrid& grid, std::span<const VolumeKey> stored) {
  HM_CHECK(!saving(), "while a save is under way");
  for (const VolumeKey& key : stored)
    if (grid.contains(key) && impl_->marks.insert(key).second)
      grid.set_may_hold_interior(key, !grid.may_hold_interior(key));
}

Result<void> MapSaver::begin_save(VolumeGrid& grid, MakeHeader make_header) {
  if (const auto earlier = finish_save(grid); !earlier) return earlier;
  grid.begin_snapshot(std::exchange(impl_->pending, {}));
  impl_->writer = std::make_unique<MapWriter>(
      impl_->file, impl_->marks,
      [&marks = impl_->marks, make = std::move(make_header)] { return make(marks); });
  if (!grid.snapshot_under_way()) impl_->writer->close();
  return {};
}

Result<void> MapSaver::continue_save(VolumeGrid& grid) {
  if (!impl_->writer) return impl_->outcome;
  if (impl_->writer->is_done()) return finish_save(grid);
  const Stopwatch clock;
  while (grid.snapshot_under_way() && impl_->writer->waiting() < kMostWaiting &&
         clock.milliseconds() < kContinue_ms)
    impl_->hand_over(grid);
  return {};
}

Result<void> MapSaver::finish_save(VolumeGrid& grid) {
  if (!impl_->writer) return impl_->outcome;
  while (grid.snapshot_under_way()) {
    impl_->writer->wait_below(kMostWaiting);
    impl_->hand_over(grid);
  }
  if (const auto outcome = impl_->writer->finish(); !outcome) impl_->outcome = outcome;
  impl_->writer.reset();
  return impl_->outcome;
}

Result<void> MapSaver::move_file(const std::filesystem::path& path,
                                 const std::function<Result<void>()>& move) {
  HM_CHECK(!saving(), "while a save is under way");
  { const MapFile closed = std::move(impl_->file); }
  if (const auto moved = move(); !moved) return moved;
  auto file = MapFile::open(path, MapOpenMode::kReadWrite);
  if (!file) return forward_error(file);
  impl_->file = std::move(*file);
  return {};
}

Result<void> MapSaver::save(VolumeGrid& grid, MakeHeader make_header) {
  if (const auto begun = begin_save(grid, std::move(make_header)); !begun) return begun;
  return finish_save(grid);
}

Result<void> MapSaver::save(VolumeGrid& grid, const MapHeader& header) {
  return save(grid, [header](const std::set<VolumeKey>&) { return header; });
}

}  // namespace hm
