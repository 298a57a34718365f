#include "hm/mvog/multi_volume_grid.hpp"

#include <bit>

#include "hm/core/check.hpp"
#include "hm/mvog/multi_volume_grid_impl.hpp"

namespace hm {

using namespace mvog;

Result<void> check_params(const MvogParams& params) {
  MvogParams copy = params;
  ParamList list;
  list.add("mvog", copy);
  if (const auto good = list.check(); !good) return forward_error(good);
  if (params.same_view_cap > params.evidence_cap)
    return fail(ErrorCode::kInvalidValue, "mvog.same_view_cap", "{} is more than evidence_cap ({})",
                params.same_view_cap, params.evidence_cap);
  return {};
}

MultiVolumeGrid::Impl::Impl(const MvogParams& p) : params(p), columns_per_m(1 / p.resolution_m), updater(p) {
  const auto good = check_params(p);
  HM_CHECK(good.has_value(), "{}", good ? "" : to_string(good.error()));
}

MultiVolumeGrid::MultiVolumeGrid(const MvogParams& params) : impl_(std::make_unique<Impl>(params)) {}
MultiVolumeGrid::~MultiVolumeGrid() = default;
MultiVolumeGrid::MultiVolumeGrid(MultiVolumeGrid&&) noexcept = default;
MultiVolumeGrid& MultiVolumeGrid::operator=(MultiVolumeGrid&&) noexcept = default;

const MvogParams& MultiVolumeGrid::params() const { return impl_->params; }
std::uint64_t MultiVolumeGrid::revision() const { return impl_->revision; }
std::size_t MultiVolumeGrid::columns_refused() const { return impl_->columns_refused; }
std::size_t MultiVolumeGrid::bytes() const { return sizeof(*this) + sizeof(Impl) + impl_->store.bytes(); }

/// True if a recent scan was taken from this position, which becomes the latest.
bool MultiVolumeGrid::Impl::note_view(const Eigen::Vector3d& p_world_origin) {
  const double near_m = params.same_view_distance_cell * params.resolution_m;
  std::size_t i = 0;
  while (i < view_count && (views[i] - p_world_origin).norm() >= near_m) ++i;
  const bool known = i < view_count;
  if (!known) i = view_count < kViews ? view_count++ : kViews - 1;
  const Eigen::Vector3d view = known ? views[i] : p_world_origin;
  for (; i > 0; --i) views[i] = views[i - 1];
  views[0] = view;
  return known;
}

/// Lowest level of a scan with a valid origin.
int MultiVolumeGrid::Impl::lowest_level(const BeamScan& scan) const {
  double lowest_m = scan.p_world_origin.z();
  for (const auto& points : {scan.p_world_returns, scan.p_world_no_returns})
    for (const Eigen::Vector3f& p : points) lowest_m = std::min<double>(lowest_m, p.z());  // never NaN
  return static_cast<int>(std::max<double>(2 * columns_per_m * lowest_m, kMinLevel));
}

void MultiVolumeGrid::Impl::rasterise(const BeamScan& scan, BeamScanStats& stats) {
  const Eigen::Vector3d origin = to_cells(scan.p_world_origin);
  const bool finite_origin = scan.p_world_origin.allFinite(), good_origin = finite_origin && can_hold(origin);
  const bool count_glancing = (scans + 1) % static_cast<std::uint64_t>(params.glancing_period) == 0;
  raster.begin(good_origin ? origin : Eigen::Vector3d::Zero(), good_origin ? lowest_level(scan) - 2 : 0,
               count_glancing);
  const auto usable = [&](const Eigen::Vector3f& p_world, Eigen::Vector3d& end) {
    if (!finite_origin || !p_world.allFinite()) {
      ++stats.not_finite;
      return false;
    }
    end = to_cells(p_world.cast<double>());
    const Eigen::Vector3d d = end - origin;
    if (good_origin && can_hold(end) && d.x() * d.x() + d.y() * d.y() < kMaxBeamCells * kMaxBeamCells)
      return true;
    ++stats.out_of_bounds;
    return false;
  };
  Eigen::Vector3d end;
  for (const Eigen::Vector3f& p : scan.p_world_returns) {
    if (!usable(p, end)) continue;
    raster.add_return(end);
    ++stats.returns;
  }
  for (const Eigen::Vector3f& p : scan.p_world_no_returns) {
    if (!usable(p, end)) continue;
    raster.add_no_return(end);
    ++stats.no_returns;
  }
}

/// Updates the observed columns, and rebuilds the tile's block if any has changed.
void MultiVolumeGrid::Impl::update_tile(const ScanLayers::Patch& patch, std::size_t tile,
                                        BeamScanStats& stats) {
  std::uint64_t left = ScanLayers::columns_seen(patch, tile);
  if (left == 0) return;
  const TileKey key = ScanLayers::tile_key(patch, tile);
  const Tile* old = store.find(key);
  const auto columns = static_cast<std::size_t>(std::popcount(left));
  stats.columns += columns;
  std::uint64_t different = 0;
  std::size_t end = 0;
  for (; left != 0; left &= left - 1) {
    const auto place = static_cast<unsigned>(std::countr_zero(left));
    const auto scan_words = raster.layers().take(patch, tile, place);
    const ColumnUnits column = old ? old->column(place) : ColumnUnits{};
    const std::size_t most = end + ColumnUpdater::max_units(column, scan_words);
    if (updated.size() < most) updated.resize(2 * most);
    const std::size_t units = updater.update(column, scan_words, stats.same_view, updated.data() + end);
    different |= static_cast<std::uint64_t>(units > 0) << place;
    updated_from[place] = end;
    updated_end[place] = end += units;
  }
  if (different == 0) return;
  if (make_block(old, different) && store.write(key, block, revision + 1, max_store_bytes()))
    changed = true;
  else
    stats.columns_refused += columns;
}

/// Builds a tile's block with the changed columns replaced. False when it would be too large.
bool MultiVolumeGrid::Impl::make_block(const Tile* old, std::uint64_t different) {
  block.resize(kOffsets);
  std::size_t place = 0;
  while (place < kTileColumns) {
    // Unchanged columns up to the next changed one are copied at once.
    const std::size_t next = std::min<std::size_t>(
        kTileColumns, place + static_cast<std::size_t>(std::countr_zero(different >> place)));
    if (old) {
      const std::size_t first = old->block.units[place], end = old->block.units[next];
      const std::size_t at = block.size();
      block.insert(block.end(), old->block.units + first, old->block.units + end);
      for (std::size_t i = place; i < next; ++i)
        block[i] = static_cast<std::uint16_t>(old->block.units[i] - first + at);
    } else {
      std::fill(block.begin() + static_cast<std::ptrdiff_t>(place),
                block.begin() + static_cast<std::ptrdiff_t>(next), static_cast<std::uint16_t>(block.size()));
    }
    if (next == kTileColumns) break;
    block[next] = static_cast<std::uint16_t>(block.size());
    block.insert(block.end(), updated.begin() + static_cast<std::ptrdiff_t>(updated_from[next]),
                 updated.begin() + static_cast<std::ptrdiff_t>(updated_end[next]));
    place = next + 1;
  }
  if (block.size() > std::numeric_limits<std::uint16_t>::max()) return false;
  block[kTileColumns] = static_cast<std::uint16_t>(block.size());
  return true;
}

BeamScanStats MultiVolumeGrid::insert(const BeamScan& scan) {
  BeamScanStats stats;
  impl_->rasterise(scan, stats);
  if (stats.returns + stats.no_returns == 0) return stats;
  ++impl_->scans;
  stats.same_view = impl_->note_view(scan.p_world_origin);
  impl_->changed = false;
  for (const ScanLayers::Patch& patch : impl_->raster.layers().patches())
    for (std::size_t tile = 0; tile < kPatchTiles; ++tile) impl_->update_tile(patch, tile, stats);
  if (impl_->changed) ++impl_->revision;
  impl_->columns_refused += stats.columns_refused;
  return stats;
}

BeamScanStats MultiVolumeGrid::insert(std::span<const Eigen::Vector3f> p_world_points,
                                      const Eigen::Vector3d& p_world_origin) {
  return insert({p_world_origin, p_world_points, {}});
}

RunCode MultiVolumeGrid::Impl::code_at(const Eigen::Vector3d& p_world) const {
  const Eigen::Vector3d p = to_cells(p_world);
  if (!can_hold(p)) return kUnknownCode;
  const int x = static_cast<int>(std::floor(p.x())), y = static_cast<int>(std::floor(p.y()));
  return mvog::code_at(store.column(x, y), static_cast<int>(std::floor(p.z())));
}

Occupancy MultiVolumeGrid::at(const Eigen::Vector3d& p_world) const {
  return impl_->tables().state(impl_->code_at(p_world));
}

Evidence MultiVolumeGrid::evidence_at(const Eigen::Vector3d& p_world) const {
  const RunCode code = impl_->code_at(p_world);
  if (is_counter(code)) return {hits_of(code), misses_of(code), Occupancy::kUnknown};
  return {0, 0, impl_->tables().state(code)};
}

std::optional<double> MultiVolumeGrid::probability_at(const Eigen::Vector3d& p_world) const {
  const RunCode code = impl_->code_at(p_world);
  if (code == kUnknownCode) return std::nullopt;
  return CodeTables::probability(code);
}

std::vector<ChangedTile> MultiVolumeGrid::changed_since(std::uint64_t revision) const {
  std::vector<ChangedTile> changed;
  const double tile_m = kTileSide * impl_->params.resolution_m;
  for (const Tile* tile = impl_->store.latest(); tile && tile->revision > revision;
       tile = impl_->store.older(*tile)) {
    const Eigen::Vector2d min_m = Eigen::Vector2d(tile->key.x, tile->key.y) * tile_m;
    changed.push_back({min_m, min_m + Eigen::Vector2d(tile_m, tile_m), tile->revision});
  }
  return changed;
}

}  // namespace hm
