#include "hm/sim/office/office_floor.hpp"

#include <algorithm>
#include <cmath>

#include "hm/core/check.hpp"
#include "hm/core/rng.hpp"

namespace hm {
namespace {

constexpr double kLeast_m = 30, kOuterRoomDepth_m = 5, kRoomWidth_m = 4;
constexpr double kColumnSpacing_m = 25, kRowSpacing_m = 15;
constexpr double kOfficeWall_m = 0.12, kDoorBegin_m = 0.6, kDoor_m = 0.95, kDoorNiche_m = 0.05;
constexpr double kTurningPlace_m = 1.9;  // behind the door
constexpr double kOpenRatio = 0.4, kAjarRatio = 0.15, kMeetingRatio = 0.12, kOwnThingRatio = 0.2,
                 kGlassEndRatio = 0.3;

/// A rectangle with a corner at `origin`, x along `right` and y along `inward` (unit vectors).
struct Place {
  Vec2 origin, right, inward;
  [[nodiscard]] Vec2 at(double x, double y) const { return origin + right * x + inward * y; }
  [[nodiscard]] Place moved(double x) const { return {origin + right * x, right, inward}; }
};

class FloorBuilder {
 public:
  explicit FloorBuilder(std::uint64_t seed) : rng_(seed) {}

  /// Rooms side by side along a corridor on the side y < 0 of their place.
  void add_row(const Place& place, double length_m, double depth_m, bool windows) {
    const int rooms = std::max(1, static_cast<int>(std::lround(length_m / kRoomWidth_m)));
    const double width_m = length_m / rooms;
    for (int i = 0; i < rooms; ++i) add_room(place.moved(i * width_m), {width_m, depth_m}, windows);
  }
  /// The end of a block, whose other side is a row's last room.
  void add_end(const Vec2& a, const Vec2& b) {
    const bool glass = rng_.uniform() < kGlassEndRatio;
    add(a, a + 0.3 * (b - a));
    add(a + 0.3 * (b - a), a + 0.45 * (b - a), glass);
    add(a + 0.45 * (b - a), b);
  }
  OfficeFloor floor;

 private:
  void add(const Vec2& a, const Vec2& b, bool glass = false) { floor.walls.push_back({a, b, glass}); }
  void add_box(const Place& place, const Vec2& low, const Vec2& high) {
    const Vec2 corners[] = {place.at(low.x(), low.y()), place.at(high.x(), low.y()),
                            place.at(high.x(), high.y()), place.at(low.x(), high.y())};
    for (std::size_t i = 0; i < 4; ++i) add(corners[i], corners[(i + 1) % 4]);
  }
  void add_room(const Place& place, const Vec2& size, bool windows);
  void add_front(const Place& place, double width_m, bool glass);
  bool add_door(const Place& place);
  void add_furniture(const Place& place, const Vec2& size, bool meeting);

  Rng rng_;
};

/// The wall at the corridor: two faces with the opening of the door, or a pane beside the door.
void FloorBuilder::add_front(const Place& place, double width_m, bool glass) {
  const double end = kDoorBegin_m + kDoor_m;
  for (const double y : {0.0, kOfficeWall_m}) add(place.at(0, y), place.at(kDoorBegin_m, y));
  for (const double x : {kDoorBegin_m, end}) add(place.at(x, 0), place.at(x, kOfficeWall_m));
  if (glass) return add(place.at(end, 0), place.at(width_m, 0), true);
  for (const double y : {0.0, kOfficeWall_m}) add(place.at(end, y), place.at(width_m, y));
}

/// True for a door that stands wide open.
bool FloorBuilder::add_door(const Place& place) {
  const double kind = rng_.uniform();
  if (kind >= kOpenRatio + kAjarRatio) {
    add(place.at(kDoorBegin_m, kDoorNiche_m), place.at(kDoorBegin_m + kDoor_m, kDoorNiche_m));
    return false;
  }
  const bool open = kind < kOpenRatio;
  const double angle = open ? rng_.uniform(1.5, 1.7) : rng_.uniform(0.3, 0.9);
  add(place.at(kDoorBegin_m, kOfficeWall_m),
      place.at(kDoorBegin_m + kDoor_m * std::cos(angle), kOfficeWall_m + kDoor_m * std::sin(angle)));
  return open;
}

void FloorBuilder::add_furniture(const Place& place, const Vec2& size, bool meeting) {
  if (meeting) return add_box(place, {2.3, 2.6}, {size.x() - 0.7, size.y() - 1.2});
  add_box(place, {size.x() - 0.6, 0.6}, {size.x() - 0.15, 2.2});  // a cabinet
  for (const double x : {1.1, 2.6})                               // the legs of a desk at the back wall
    for (const double y : {size.y() - 1.3, size.y() - 0.5}) add_box(place, {x, y}, {x + 0.06, y + 0.06});
  if (rng_.uniform() >= kOwnThingRatio) return;
  const Vec2 low(rng_.uniform(2.1, size.x() - 1.3), rng_.uniform(2.4, size.y() - 1.8));
  add_box(place, low, low + Vec2(rng_.uniform(0.3, 0.7), rng_.uniform(0.3, 0.7)));
}

void FloorBuilder::add_room(const Place& place, const Vec2& size, bool windows) {
  const bool meeting = rng_.uniform() < kMeetingRatio;
  add_front(place, size.x(), meeting);
  const double left = kOfficeWall_m / 2, right = size.x() - kOfficeWall_m / 2,
               back = size.y() - kOfficeWall_m / 2;
  add(place.at(left, kOfficeWall_m), place.at(left, back));
  add(place.at(right, kOfficeWall_m), place.at(right, back));
  const double pane_begin = windows ? 0.8 : right, pane_end = windows ? size.x() - 0.8 : right;
  add(place.at(left, back), place.at(pane_begin, back));
  if (windows) {
    add(place.at(pane_begin, back), place.at(pane_end, back), true);
    add(place.at(pane_end, back), place.at(right, back));
  }
  add_furniture(place, size, meeting);
  const double door = kDoorBegin_m + kDoor_m / 2;
  const bool open = add_door(place);
  floor.rooms.push_back({place.at(door, -OfficeFloor::kCorridor_m / 2),
                         place.at(door + 0.3, kOfficeWall_m + kTurningPlace_m), open});
}

std::vector<double> middle_lines(double size_m, double spacing_m) {
  const double first = kOuterRoomDepth_m + OfficeFloor::kCorridor_m / 2, last = size_m - first;
  const int gaps = std::max(1, static_cast<int>(std::lround((last - first) / spacing_m)));
  std::vector<double> lines;
  for (int i = 0; i <= gaps; ++i) lines.push_back(first + (last - first) * i / gaps);
  return lines;
}

}  // namespace

OfficeFloor make_office_floor(double width_m, double depth_m, std::uint64_t seed) {
  HM_CHECK(width_m >= kLeast_m && depth_m >= kLeast_m, "a floor of {} x {} m", width_m, depth_m);
  FloorBuilder builder(seed);
  OfficeFloor& floor = builder.floor;
  floor.columns_m = middle_lines(width_m, kColumnSpacing_m);
  floor.rows_m = middle_lines(depth_m, kRowSpacing_m);
  const Vec2 ex = Vec2::UnitX(), ey = Vec2::UnitY();
  const double half = OfficeFloor::kCorridor_m / 2, outer = kOuterRoomDepth_m;
  builder.add_row({{outer, outer}, ex, -ey}, width_m - 2 * outer, outer, true);
  builder.add_row({{outer, depth_m - outer}, ex, ey}, width_m - 2 * outer, outer, true);
  builder.add_row({{outer, outer}, ey, -ex}, depth_m - 2 * outer, outer, true);
  builder.add_row({{width_m - outer, outer}, ey, ex}, depth_m - 2 * outer, outer, true);
  for (std::size_t i = 0; i + 1 < floor.columns_m.size(); ++i)
    for (std::size_t j = 0; j + 1 < floor.rows_m.size(); ++j) {
      const Vec2 low(floor.columns_m[i] + half, floor.rows_m[j] + half);
      const Vec2 high(floor.columns_m[i + 1] - half, floor.rows_m[j + 1] - half);
      const Vec2 size = high - low;
      builder.add_row({low, ex, ey}, size.x(), size.y() / 2, false);
      builder.add_row({high, -ex, -ey}, size.x(), size.y() / 2, false);
      builder.add_end(low, {low.x(), high.y()});
      builder.add_end({high.x(), low.y()}, high);
    }
  return std::move(builder.floor);
}

}  // namespace hm
