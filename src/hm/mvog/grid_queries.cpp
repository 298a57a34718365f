// Rays, boxes and columns of a MultiVolumeGrid.
#include "hm/mvog/multi_volume_grid.hpp"
#include "hm/mvog/multi_volume_grid_impl.hpp"

namespace hm {

using namespace mvog;

namespace {

/// Calls visit(first level, level after the last, code) for the whole of [low, high] of a column, bottom to
/// top, unknown space included.
template <class Visit>
void for_each_run_within(ColumnUnits column, int low, int high, Visit&& visit) {
  int level = low;
  for_each_run(column, [&](int from, int to, RunCode code) {
    if (to <= level || from > high) return;
    if (from > level) visit(level, from, kUnknownCode);
    level = std::min(to, high + 1);
    visit(std::max(from, low), level, code);
  });
  if (level <= high) visit(level, high + 1, kUnknownCode);
}

/// Point that stops a ray.
struct Stop {
  int level = 0;
  Occupancy state = Occupancy::kFree;
};

/// First stop of a ray that traverses a column from one level to another.
Stop first_stop(const CodeTables& tables, ColumnUnits column, int from, int to, UnknownSpace unknown) {
  Stop stop;
  for_each_run_within(column, std::min(from, to), std::max(from, to), [&](int low, int end, RunCode code) {
    const Occupancy state = tables.state(code);
    const bool stops =
        state == Occupancy::kOccupied || (state == Occupancy::kUnknown && unknown == UnknownSpace::kStops);
    if (!stops || (from <= to && stop.state != Occupancy::kFree)) return;
    stop = {from <= to ? low : end - 1, state};
  });
  return stop;
}

/// Columns traversed by a ray, with the ray's fractions at entry and exit.
class ColumnWalk {
 public:
  ColumnWalk(const Eigen::Vector3d& from, const Eigen::Vector3d& to)
      : x_(static_cast<int>(std::floor(from.x()))), y_(static_cast<int>(std::floor(from.y()))) {
    const Eigen::Vector3d d = to - from;
    walls_ = {std::abs(static_cast<int>(std::floor(to.x())) - x_),
              std::abs(static_cast<int>(std::floor(to.y())) - y_)};
    step_ = {d.x() < 0 ? -1 : 1, d.y() < 0 ? -1 : 1};
    per_ = {std::abs(1 / d.x()), std::abs(1 / d.y())};
    next_ = {walls_[0] ? (x_ + (step_[0] > 0) - from.x()) / d.x() : kNever,
             walls_[1] ? (y_ + (step_[1] > 0) - from.y()) / d.y() : kNever};
  }
  [[nodiscard]] int x() const { return x_; }
  [[nodiscard]] int y() const { return y_; }
  [[nodiscard]] double enters() const { return enters_; }
  [[nodiscard]] double leaves() const { return std::min({next_[0], next_[1], 1.0}); }
  /// False at the end of the ray.
  bool step() {
    if (walls_[0] + walls_[1] == 0) return false;
    enters_ = leaves();
    const std::size_t axis = next_[0] < next_[1] ? 0 : 1;
    (axis == 0 ? x_ : y_) += step_[axis];
    next_[axis] = --walls_[axis] > 0 ? next_[axis] + per_[axis] : kNever;
    return true;
  }

 private:
  static constexpr double kNever = std::numeric_limits<double>::infinity();
  int x_, y_;
  std::array<int, 2> walls_{}, step_{};
  std::array<double, 2> per_{}, next_{};
  double enters_ = 0;
};

int floor_int(double value) { return static_cast<int>(std::floor(value)); }

/// First and last columns of a box, within the map's index range.
struct ColumnBox {
  int min_x, min_y, max_x, max_y;
  [[nodiscard]] bool holds(int x, int y) const {
    return x >= min_x && x <= max_x && y >= min_y && y <= max_y;
  }
};

/// Calls visit(column) for the part of a tile in a box. Returns false as soon as visit does.
template <class Visit>
bool visit_tile(TileKey key, const Tile* tile, const ColumnBox& box, Visit&& visit) {
  for (int place = 0; place < kTileColumns; ++place) {
    const int x = key.x * 8 + (place & 7), y = key.y * 8 + (place >> 3);
    if (!box.holds(x, y)) continue;
    if (!visit(tile ? tile->column(static_cast<std::size_t>(place)) : ColumnUnits{})) return false;
  }
  return true;
}

}  // namespace

GridRayHit MultiVolumeGrid::cast_ray(const Eigen::Vector3d& p_world_from, const Eigen::Vector3d& p_world_to,
                                     UnknownSpace unknown) const {
  const Eigen::Vector3d from = impl_->to_cells(p_world_from), to = impl_->to_cells(p_world_to), d = to - from;
  const Eigen::Vector3d way = p_world_to - p_world_from;
  if (!Impl::can_hold(from) || !Impl::can_hold(to) || d.head<2>().norm() > Impl::kMaxBeamCells)
    return {Occupancy::kUnknown, 0, p_world_from};
  ColumnWalk walk(from, to);
  do {
    const int in = floor_int(from.z() + d.z() * walk.enters()),
              out = floor_int(from.z() + d.z() * walk.leaves());
    const Stop stop = first_stop(impl_->tables(), impl_->store.column(walk.x(), walk.y()), in, out, unknown);
    if (stop.state == Occupancy::kFree) continue;
    const int wall = d.z() > 0 ? stop.level : stop.level + 1;
    const double share = stop.level == in ? walk.enters() : std::clamp((wall - from.z()) / d.z(), 0.0, 1.0);
    return {stop.state, share * way.norm(), p_world_from + share * way};
  } while (walk.step());
  return {Occupancy::kFree, way.norm(), p_world_to};
}

Occupancy MultiVolumeGrid::in_box(const Box3& box_world) const {
  if (box_world.isEmpty()) return Occupancy::kFree;
  const Eigen::Vector3d min = impl_->to_cells(box_world.min()), max = impl_->to_cells(box_world.max());
  const bool inside = Impl::can_hold(min) && Impl::can_hold(max);
  const auto column_of = [](double v) {
    return floor_int(std::clamp(v, -Impl::kMaxColumn, Impl::kMaxColumn));
  };
  const auto level_of = [](double v) { return floor_int(std::clamp<double>(v, kMinLevel, kMaxLevel)); };
  const ColumnBox box{column_of(min.x()), column_of(min.y()), column_of(max.x()), column_of(max.y())};
  const int low = level_of(min.z()), high = level_of(max.z());
  bool unknown = !inside;
  const auto visit = [&](ColumnUnits column) {
    bool occupied = false;
    for_each_run_within(column, low, high, [&](int, int, RunCode code) {
      occupied |= impl_->tables().state(code) == Occupancy::kOccupied;
      unknown |= code == kUnknownCode;
    });
    return !occupied;
  };
  const TileKey first = tile_of(box.min_x, box.min_y), last = tile_of(box.max_x, box.max_y);
  const double tiles = (1.0 + last.x - first.x) * (1.0 + last.y - first.y);
  if (tiles > static_cast<double>(impl_->store.tiles().size())) {  // a missing tile is unknown
    unknown = true;
    for (const Tile& tile : impl_->store.tiles())
      if (!visit_tile(tile.key, &tile, box, visit)) return Occupancy::kOccupied;
    return Occupancy::kUnknown;
  }
  for (int y = first.y; y <= last.y; ++y)
    for (int x = first.x; x <= last.x; ++x)
      if (!visit_tile({x, y}, impl_->store.find({x, y}), box, visit)) return Occupancy::kOccupied;
  return unknown ? Occupancy::kUnknown : Occupancy::kFree;
}

std::vector<VerticalVolume> MultiVolumeGrid::volumes_at(const Eigen::Vector2d& p_world) const {
  std::vector<VerticalVolume> volumes;
  const Eigen::Vector3d p = impl_->to_cells({p_world.x(), p_world.y(), 0});
  if (!Impl::can_hold(p)) return volumes;
  const double level_m = impl_->level_m();
  for_each_run(impl_->store.column(floor_int(p.x()), floor_int(p.y())), [&](int from, int to, RunCode code) {
    const Occupancy state = impl_->tables().state(code);
    if (state == Occupancy::kUnknown) return;
    const double probability = CodeTables::probability(code), height = (to - from) * level_m;
    const bool goes_on =
        !volumes.empty() && volumes.back().state == state && volumes.back().top_m == from * level_m;
    if (!goes_on) {
      volumes.push_back({from * level_m, to * level_m, probability, state});
      return;
    }
    VerticalVolume& last = volumes.back();
    last.probability =
        (last.probability * last.height_m() + probability * height) / (last.height_m() + height);
    last.top_m = to * level_m;
  });
  return volumes;
}

}  // namespace hm
