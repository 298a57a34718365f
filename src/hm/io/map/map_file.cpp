#include "hm/io/map/map_file.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <system_error>
#include <utility>

#include "hm/core/check.hpp"
#include "hm/io/map/map_storage.hpp"

namespace hm {

namespace {
constexpr std::size_t kMaxProblems = 20;
}

struct MapFile::Impl {
  MapStorage storage;
};

Result<MapFile> MapFile::open(const std::filesystem::path& path, MapOpenMode mode) {
  auto storage = MapStorage::open(path, mode);
  if (!storage) return forward_error(storage);
  return MapFile(std::make_unique<Impl>(Impl{std::move(*storage)}));
}

Result<MapFile> MapFile::create(const std::filesystem::path& path, const MapHeader& header) {
  if (!(header.voxel_size_m > 0) || !(header.sdf_unit_m > 0) ||
      !std::isfinite(header.voxel_size_m + header.sdf_unit_m))
    return fail(ErrorCode::kInvalidValue, path.string(), "voxel size {} m, distance unit {} m",
                header.voxel_size_m, header.sdf_unit_m);
  if (const auto made = MapStorage::create(path, header); !made) return forward_error(made);
  return open(path, MapOpenMode::kReadWrite);
}

MapFile::MapFile(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
MapFile::~MapFile() = default;
MapFile::MapFile(MapFile&&) noexcept = default;
MapFile& MapFile::operator=(MapFile&&) noexcept = default;

// ---- reading ----

const MapHeader& MapFile::header() const { return impl_->storage.header(); }
const std::filesystem::path& MapFile::path() const { return impl_->storage.path(); }
const std::vector<std::string>& MapFile::problems() const { return impl_->storage.problems(); }
std::uint64_t MapFile::block_count() const { return summarise(impl_->storage.directory()).blocks; }
std::optional<MapKeyBox> MapFile::key_bounds() const { return bounds(impl_->storage.directory()); }

std::uint64_t MapFile::file_bytes() const {
  std::error_code ignored;
  const auto size = std::filesystem::file_size(impl_->storage.path(), ignored);
  return ignored ? 0 : size;
}

Result<MapReadReport> MapFile::for_each_block(const std::optional<MapKeyBox>& box,
                                              const std::function<bool(const MapBlockView&)>& visit) const {
  MapReadReport report;
  report.problems = impl_->storage.problems();
  if (!box) report.blocks_skipped = impl_->storage.lost_blocks();
  for (const auto& [page, entry] : impl_->storage.directory()) {
    const std::uint64_t chosen = box ? blocks_in(*box, page, entry.blocks) : entry.blocks;
    if (chosen == 0) continue;
    const auto blocks = impl_->storage.read_page(page, entry);
    if (!blocks) {
      if (!impl_->storage.lenient()) return forward_error(blocks);
      report.blocks_skipped += static_cast<std::uint64_t>(std::popcount(chosen));
      if (report.problems.size() < kMaxProblems) report.problems.push_back(blocks.error().message);
      continue;
    }
    for (std::uint64_t left = chosen; left != 0; left &= left - 1) {
      const auto i = static_cast<std::size_t>(std::countr_zero(left));
      MapBlockView view{block_key(page, static_cast<int>(i)), {blocks->voxels[i], kMapBlockVoxels}, {}};
      if (blocks->colors[i]) view.colors = {blocks->colors[i], kMapBlockVoxels};
      ++report.blocks_read;
      if (visit(view)) continue;
      report.complete = false;
      return report;
    }
  }
  return report;
}

namespace {

/// Indices of items grouped by page, in stable order.
template <class Item, class KeyOf>
std::vector<std::pair<MapPageKey, std::size_t>> by_page(std::span<const Item> items, KeyOf key_of) {
  std::vector<std::pair<MapPageKey, std::size_t>> order;
  order.reserve(items.size());
  for (std::size_t i = 0; i < items.size(); ++i) order.emplace_back(page_of(key_of(items[i])), i);
  std::sort(order.begin(), order.end());
  return order;
}

}  // namespace

Result<void> MapFile::put_blocks(std::span<const MapBlockView> blocks) {
  if (const auto begun = impl_->storage.begin(); !begun) return begun;
  const auto order = by_page(blocks, [](const MapBlockView& block) { return block.key; });
  for (std::size_t i = 0; i < order.size();) {
    const MapPageKey page = order[i].first;
    MapPageBlocks fresh;
    std::uint64_t replaced = 0;
    for (; i < order.size() && order[i].first == page; ++i) {
      const MapBlockView& block = blocks[order[i].second];
      HM_CHECK(block.voxels.size() == kMapBlockVoxels, "{} voxels", block.voxels.size());
      HM_CHECK(block.colors.empty() || block.colors.size() == kMapBlockVoxels, "{} colours",
               block.colors.size());
      const auto place = static_cast<std::size_t>(block_in_page(block.key));
      fresh.voxels[place] = block.voxels.data();
      fresh.colors[place] = block.colors.empty() ? nullptr : block.colors.data();
      replaced |= std::uint64_t{1} << place;
    }
    const auto old = impl_->storage.directory().find(page);
    if (old != impl_->storage.directory().end() && (old->second.blocks & ~replaced) != 0) {
      const auto kept = impl_->storage.read_page(page, old->second);
      if (!kept) return impl_->storage.settle(forward_error(kept));
      for (std::size_t place = 0; place < kMapPageBlocks; ++place) {
        if (replaced >> place & 1u) continue;
        fresh.voxels[place] = kept->voxels[place];
        fresh.colors[place] = kept->colors[place];
      }
    }
    if (const auto written = impl_->storage.write_page(page, fresh); !written)
      return impl_->storage.settle(written);
  }
  return {};
}

Result<void> MapFile::erase(std::span<const MapBlockKey> keys) {
  if (const auto begun = impl_->storage.begin(); !begun) return begun;
  const auto order = by_page(keys, [](const MapBlockKey& key) { return key; });
  for (std::size_t i = 0; i < order.size();) {
    const MapPageKey page = order[i].first;
    std::uint64_t doomed = 0;
    for (; i < order.size() && order[i].first == page; ++i)
      doomed |= std::uint64_t{1} << static_cast<unsigned>(block_in_page(keys[order[i].second]));
    const auto entry = impl_->storage.directory().find(page);
    if (entry == impl_->storage.directory().end() || (entry->second.blocks & doomed) == 0) continue;
    if ((entry->second.blocks & ~doomed) == 0) {
      if (const auto removed = impl_->storage.remove_page(page); !removed)
        return impl_->storage.settle(removed);
      continue;
    }
    auto kept = impl_->storage.read_page(page, entry->second);
    if (!kept) return impl_->storage.settle(forward_error(kept));
    for (std::size_t place = 0; place < kMapPageBlocks; ++place)
      if (doomed >> place & 1u) kept->voxels[place] = kept->colors[place] = nullptr;
    if (const auto written = impl_->storage.write_page(page, *kept); !written)
      return impl_->storage.settle(written);
  }
  return {};
}

Result<void> MapFile::clear() {
  if (const auto begun = impl_->storage.begin(); !begun) return begun;
  return impl_->storage.settle(impl_->storage.remove_all_pages());
}

Result<void> MapFile::commit(const std::string& state_json) {
  MapHeader next = header();
  next.state_json = state_json;
  return commit(next);
}

Result<void> MapFile::commit(const MapHeader& header) {
  HM_CHECK(
      header.voxel_size_m == this->header().voxel_size_m && header.sdf_unit_m == this->header().sdf_unit_m,
      "the voxels of a map keep their size and unit");
  if (const auto begun = impl_->storage.begin(); !begun) return begun;
  return impl_->storage.settle(impl_->storage.commit(header));
}

}  // namespace hm
