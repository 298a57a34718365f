// Paths of the flights.
#include "hm/sim/motion/flight.hpp"
#include "hm/sim/world/house_plan.hpp"

namespace hm {
namespace {

constexpr double kStand_s = 3;  ///< on the ground, before and after
constexpr double kHover_s = 4;

/// Collects way points.
class Way {
 public:
  /// Starts on the ground.
  explicit Way(const Vec2& at) : points_{{{at.x(), at.y(), kBaseOverGround_m}, kStand_s}} {}

  /// Flies vertically.
  Way& climb(double height_m) { return go(here().x(), here().y(), height_m); }
  /// Flies to a position at the current height.
  Way& go(double x, double y) { return go(x, y, here().z()); }
  Way& go(double x, double y, double height_m) {
    points_.push_back({{x, y, height_m}, 0});
    return *this;
  }
  Way& hover() {
    points_.back().hover_s += kHover_s;
    return *this;
  }
  /// Flies from the middle of the hallway through the door of a room.
  Way& enter(std::size_t room) { return pass_door(room, true); }
  Way& leave(std::size_t room) { return pass_door(room, false); }
  std::vector<FlightPoint> land() {
    climb(kBaseOverGround_m);
    points_.back().hover_s = kStand_s;
    return points_;
  }

 private:
  [[nodiscard]] const Vec3& here() const { return points_.back().position; }
  Way& pass_door(std::size_t index, bool inwards) {
    constexpr double kDepth_m = 0.9;  // far enough for the curve to be straight in the door
    const RoomPlan& room = house_rooms()[index];
    const double inside_y = room.y1 < kHallCenter_y ? kHallLow_y - kDepth_m : kHallHigh_y + kDepth_m;
    const double first_y = inwards ? kHallCenter_y : inside_y;
    return go(room.door_x, first_y).go(room.door_x, kHallCenter_y + inside_y - first_y);
  }
  std::vector<FlightPoint> points_;
};

enum Room : std::size_t { kLiving, kDining, kKitchen, kStudy, kBedroom, kBath, kKids, kGuest, kWorkshop };

/// Flies through living room, dining room and kitchen: in by the first door, out by the last.
void fly_south(Way& way) {
  way.enter(kLiving)
      .go(6.4, 4.9)
      .go(4.6, 4.6, 1.3)
      .go(1.3, 3.6)
      .go(2.3, 2.6)
      .go(2.3, 1.0)
      .hover();                                                                    // over table and sofa
  way.go(3.6, 0.9).go(4.7, 1.3, 1.6).go(6.3, 1.1).go(6.6, 3.7).go(8.0, 3.7, 1.5);  // over platform and
                                                                                   // railing
  way.go(8.9, 3.7).go(10.2, 4.6).go(10.2, 2.0).hover().go(10.2, 1.0);              // over the dining table
  way.go(11.5, 1.0, 1.2).go(11.5, 4.95).go(12.5, 4.95).go(14.2, 4.4, 1.35).go(13.9, 1.6).hover();
  way.go(14.4, 3.6, 1.2).leave(kKitchen);
}

void fly_east(Way& way) {
  way.enter(kStudy).go(17.6, 3.4, 1.5).hover().go(18.2, 4.6, 1.3).leave(kStudy);
  way.enter(kWorkshop).go(18.3, 12.6, 1.2).hover().go(17.9, 10.4, 1.4).leave(kWorkshop);
}

void fly_north(Way& way) {
  way.enter(kGuest).go(14.1, 10.0, 1.3).go(14.1, 12.3).go(14.1, 10.0).leave(kGuest);  // twice over the table
  way.enter(kKids).go(9.9, 11.6, 1.2).go(8.6, 13.6, 1.4).hover().go(9.6, 11.0, 1.2).leave(kKids);
  way.enter(kBath).go(6.4, 11.6, 1.3).hover().leave(kBath);
  way.enter(kBedroom).go(3.3, 11.7, 1.2).go(1.1, 11.7, 1.4).hover().go(3.3, 11.9).go(3.6, 10.4, 1.2);  // the
                                                                                                       // bed
  way.leave(kBedroom);
}

}  // namespace

Flight house_flight(const FlightParams& params, std::uint64_t seed) {
  Way way({3.1, kHallCenter_y});
  way.climb(1.2).hover();
  fly_south(way);
  fly_east(way);
  fly_north(way);
  way.go(3.1, kHallCenter_y).hover();
  return {way.land(), params, seed};
}

Flight room_flight(const FlightParams& params, std::uint64_t seed) {
  Way way({1.2, 0.2});
  way.climb(1.2).hover();
  for (const double lift_m : {0.0, 0.15}) {
    way.go(1.9, 1.0, 1.25 + lift_m).go(0.8, 1.2).go(-0.6, 1.3, 1.3 + lift_m).go(-1.5, 0.4, 1.0 + lift_m);
    way.go(-1.1, -1.0).hover().go(0.5, -1.2, 1.4 + lift_m).go(1.8, -0.8, 1.2 + lift_m).go(1.2, 0.2);
  }
  way.hover();
  return {way.land(), params, seed};
}

Flight corridor_flight(const FlightParams& params, std::uint64_t seed) {
  Way way({1.5, 0});
  way.climb(1.2).hover().go(8, 0).go(12, 0, 1.7).go(18, 0).go(21, 0, 0.8).go(28.5, 0, 1.2).hover();
  way.go(15, 0.3).hover().go(1.5, 0);
  return {way.land(), params, seed};
}

}  // namespace hm
