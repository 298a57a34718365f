// Paths of the walks through the house, the room and the corridor.
#include <cmath>
#include <numbers>

#include "hm/sim/motion/house_tours.hpp"
#include "hm/sim/motion/walk.hpp"
#include "hm/sim/world/house_plan.hpp"

namespace hm {
namespace {

constexpr double kTurn_rad = 2 * std::numbers::pi;
constexpr double kAhead_rad = -0.2;  ///< pitch while walking forwards
constexpr double kSwing_m = 4.2;     ///< walked while the pitch goes down and up once

/// Collects way points; yaw is unwrapped so that every rotation takes the shorter direction.
class Tour {
 public:
  explicit Tour(const WalkPoint& start) : points_{start} {}

  void go(const Vec2& to, double yaw_rad, double pitch_rad) {
    const double height = 1.5 + 0.08 * std::sin(0.9 * static_cast<double>(points_.size()));
    points_.push_back({{to.x(), to.y(), height}, unwrapped(yaw_rad), pitch_rad});
  }
  /// Walks to a point, looking ahead.
  void walk_to(const Vec2& to, double pitch_rad) {
    const double yaw = heading(here(), to);
    go(here(), yaw, pitch_rad);
    go(to, yaw, pitch_rad);
  }
  /// Rotates by 360 degrees on the spot.
  void spin(double pitch_rad) {
    WalkPoint p = points_.back();
    p.pitch_rad = pitch_rad;
    points_.push_back(p);
    p.yaw_rad += kTurn_rad;
    points_.push_back(p);
  }
  enum class Look { kOutward, kInward };
  /// Walks once around a closed loop, looking outwards or across it while the pitch oscillates between two
  /// angles.
  void around(const std::vector<Vec2>& loop, Look look, const Vec2& pitch_range_rad) {
    Vec2 middle = Vec2::Zero();
    for (const Vec2& p : loop) middle += p / static_cast<double>(loop.size());
    double walked = 0;
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Vec2 a = loop[i], b = loop[(i + 1) % loop.size()];
      const int steps = std::max(1, static_cast<int>(std::ceil((b - a).norm() / 0.45)));
      for (int k = 1; k <= steps; ++k) {
        const Vec2 p = a + (b - a) * (static_cast<double>(k) / steps);
        walked += (b - a).norm() / steps;
        const double outward = heading(middle, p) + (look == Look::kInward ? kTurn_rad / 2 : 0);
        const double swing = 0.5 - 0.5 * std::cos(walked * kTurn_rad / kSwing_m);
        go(p, outward, pitch_range_rad.x() + swing * (pitch_range_rad.y() - pitch_range_rad.x()));
      }
    }
  }
  [[nodiscard]] const std::vector<WalkPoint>& points() const { return points_; }
  [[nodiscard]] Vec2 here() const { return points_.back().position.head<2>(); }

 private:
  static double heading(const Vec2& from, const Vec2& to) {
    return (to - from).norm() < 1e-6 ? 0 : std::atan2(to.y() - from.y(), to.x() - from.x());
  }
  [[nodiscard]] double unwrapped(double yaw_rad) const {
    return yaw_rad + kTurn_rad * std::round((points_.back().yaw_rad - yaw_rad) / kTurn_rad);
  }
  std::vector<WalkPoint> points_;
};

/// Walks from the hallway around a room and back to the hallway.
void visit_room(Tour& tour, std::size_t index) {
  const RoomPlan& room = house_rooms()[index];
  const Vec2 in_hall(room.door_x, kHallCenter_y);
  const double inwards_rad = room.y1 < kHallCenter_y ? -kTurn_rad / 4 : kTurn_rad / 4;
  tour.go(in_hall, inwards_rad, kAhead_rad);
  for (const TourStop& stop : room_tour(index)) tour.go({stop.x_m, stop.y_m}, stop.yaw_rad, stop.pitch_rad);
  tour.go(in_hall, -inwards_rad, kAhead_rad);
}

}  // namespace

Walk house_walk() {
  const TourStop& start = hall_tour().front();
  Tour tour({{start.x_m, start.y_m, 1.5}, start.yaw_rad, start.pitch_rad});
  for (const TourStop& stop : hall_tour()) {
    if (stop.room >= 0) visit_room(tour, static_cast<std::size_t>(stop.room));
    tour.go({stop.x_m, stop.y_m}, stop.yaw_rad, stop.pitch_rad);
  }
  tour.go({start.x_m, start.y_m}, start.yaw_rad, start.pitch_rad);
  return Walk(tour.points(), {});
}

Walk room_walk() {
  const std::vector<Vec2> loop = {{1.2, 0.3},   {-0.6, 0.6}, {-1.5, 0.3},
                                  {-1.0, -0.5}, {0.6, -0.4}, {1.6, -0.7}};
  Tour tour({{1.2, 0.3, 1.5}, 0, -0.2});
  tour.around(loop, Tour::Look::kOutward, {-0.5, 0.1});
  tour.spin(0.5);
  tour.around(loop, Tour::Look::kInward, {-0.6, 0.3});
  tour.spin(-0.5);
  tour.spin(0.05);
  tour.go(loop.front(), 0, -0.2);
  return Walk(tour.points(), {});
}

Walk corridor_walk() {
  Tour tour({{1, 0, 1.5}, 0, -0.1});
  tour.walk_to({29, 0}, -0.1);
  tour.walk_to({1, 0}, -0.1);
  tour.go({1, 0}, 0, -0.1);
  return Walk(tour.points(), {});
}

}  // namespace hm
