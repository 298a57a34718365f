// Whole-map views of a MultiVolumeGrid: sizes, bounds, slices, voxels.
#include "hm/core/check.hpp"
#include "hm/mvog/multi_volume_grid.hpp"
#include "hm/mvog/multi_volume_grid_impl.hpp"

namespace hm {

using namespace mvog;

namespace {

constexpr double kMaxSliceCells = 1 << 28;

/// Calls visit(column x, column y, units) for every non-empty column, tile by tile in order.
template <class Visit>
void for_each_column(const TileStore& store, Visit&& visit) {
  for (const Tile* tile : store.sorted())
    for (std::size_t place = 0; place < kTileColumns; ++place) {
      const ColumnUnits column = tile->column(place);
      const int local = static_cast<int>(place);
      if (!column.empty()) visit(tile->key.x * 8 + (local & 7), tile->key.y * 8 + (local >> 3), column);
    }
}

/// Range of known columns and levels.
struct Extent {
  Eigen::Array3i min = Eigen::Array3i::Constant(std::numeric_limits<int>::max());
  Eigen::Array3i end = Eigen::Array3i::Constant(std::numeric_limits<int>::min());  ///< after the last
  [[nodiscard]] bool empty() const { return min.x() > end.x(); }
};

Extent extent_of(const TileStore& store) {
  Extent extent;
  for_each_column(store, [&](int x, int y, ColumnUnits column) {
    int top = base_level(column[0]);
    for (const std::uint16_t unit : column.subspan(1)) top += run_length(unit);
    extent.min = extent.min.min(Eigen::Array3i(x, y, base_level(column[0])));
    extent.end = extent.end.max(Eigen::Array3i(x + 1, y + 1, top));
  });
  return extent;
}

std::uint8_t percent(RunCode code) {
  return static_cast<std::uint8_t>(std::lround(100 * CodeTables::probability(code)));
}

}  // namespace

MvogSize MultiVolumeGrid::size() const {
  MvogSize size;
  size.bytes = bytes();
  size.working_bytes = impl_->raster.layers().bytes() + impl_->updater.bytes() +
                       (impl_->block.capacity() + impl_->updated.capacity()) * sizeof(std::uint16_t);
  size.tiles = impl_->store.tiles().size();
  for_each_column(impl_->store, [&](int, int, ColumnUnits column) {
    ++size.columns;
    size.runs += column.size() - 1;
    Occupancy before = Occupancy::kUnknown;
    for_each_run(column, [&](int, int, RunCode code) {
      const Occupancy state = impl_->tables().state(code);
      size.volumes_positive += state == Occupancy::kOccupied && before != state;
      size.volumes_negative += state == Occupancy::kFree && before != state;
      before = state;
    });
  });
  size.area_m2 = static_cast<double>(size.columns) * impl_->params.resolution_m * impl_->params.resolution_m;
  return size;
}

Box3 MultiVolumeGrid::bounds() const {
  const Extent extent = extent_of(impl_->store);
  if (extent.empty()) return {};
  const Eigen::Array3d unit(impl_->params.resolution_m, impl_->params.resolution_m, impl_->level_m());
  return {(extent.min.cast<double>() * unit).matrix(), (extent.end.cast<double>() * unit).matrix()};
}

namespace {

/// Levels [low, end) of a slice between two heights, at least one.
struct SliceLevels {
  double low = 0, end = 0;
  SliceLevels(double bottom_m, double top_m, double level_m)
      : low(std::floor(bottom_m / level_m)), end(std::max(std::ceil(top_m / level_m), low + 1)) {}
};

/// Highest probability of a column within the levels, in percent; kUnknown where nothing is known.
std::uint8_t highest_percent(ColumnUnits column, const SliceLevels& levels) {
  std::uint8_t cell = OccupancyGrid2D::kUnknown;
  for_each_run(column, [&](int from, int to, RunCode code) {
    if (code == kUnknownCode || to <= levels.low || from >= levels.end) return;
    cell = cell == OccupancyGrid2D::kUnknown ? percent(code) : std::max(cell, percent(code));
  });
  return cell;
}

}  // namespace

Result<OccupancyGrid2D> MultiVolumeGrid::slice(double bottom_m, double top_m) const {
  const Extent extent = extent_of(impl_->store);
  OccupancyGrid2D grid;
  grid.resolution_m = impl_->params.resolution_m;
  if (extent.empty() || !(bottom_m <= top_m)) return grid;
  const double width = double{1} * extent.end.x() - extent.min.x(),
               height = double{1} * extent.end.y() - extent.min.y();
  if (width * height > kMaxSliceCells)
    return fail(ErrorCode::kOutOfMemory, "slice", "the map spreads over {} x {} cells", width, height);
  grid.origin_m = grid.resolution_m * Eigen::Vector2d(extent.min.x(), extent.min.y());
  grid.cells = {static_cast<int>(width), static_cast<int>(height), OccupancyGrid2D::kUnknown};
  const SliceLevels levels(bottom_m, top_m, impl_->level_m());
  for_each_column(impl_->store, [&](int x, int y, ColumnUnits column) {
    grid.cells(x - extent.min.x(), y - extent.min.y()) = highest_percent(column, levels);
  });
  return grid;
}

OccupancyGrid2D MultiVolumeGrid::slice_square(const Eigen::Vector2i& first_cell, int side, double bottom_m,
                                              double top_m) const {
  HM_CHECK(side > 0, "a square of {} cells", side);
  OccupancyGrid2D grid;
  grid.resolution_m = impl_->params.resolution_m;
  grid.origin_m = grid.resolution_m * first_cell.cast<double>();
  grid.cells = {side, side, OccupancyGrid2D::kUnknown};
  const SliceLevels levels(bottom_m, top_m, impl_->level_m());
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x)
      if (const ColumnUnits column = impl_->store.column(first_cell.x() + x, first_cell.y() + y);
          !column.empty())
        grid.cells(x, y) = highest_percent(column, levels);
  return grid;
}

std::vector<OccupancyVoxel> MultiVolumeGrid::voxels() const {
  std::vector<OccupancyVoxel> all;
  const double size_m = impl_->params.resolution_m;
  for_each_column(impl_->store, [&](int x, int y, ColumnUnits column) {
    int last = std::numeric_limits<int>::min();  // cell of the voxel added last
    for_each_run(column, [&](int from, int to, RunCode code) {
      if (code == kUnknownCode) return;
      const auto probability = static_cast<float>(CodeTables::probability(code));
      const Occupancy state = impl_->tables().state(code);
      for (int z = from >> 1; z <= (to - 1) >> 1; ++z) {
        if (z != last)
          all.push_back({(Eigen::Vector3d(x + 0.5, y + 0.5, z + 0.5) * size_m).cast<float>(),
                         static_cast<float>(size_m), probability, state});
        else if (probability > all.back().probability) {
          all.back().probability = probability;
          all.back().state = state;
        }
        last = z;
      }
    });
  });
  return all;
}

}  // namespace hm
