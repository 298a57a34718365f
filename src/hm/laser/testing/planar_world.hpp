#pragma once
#include <cstddef>
#include <span>
#include <vector>

#include "hm/core/rng.hpp"
#include "hm/laser/matching/planar_scan.hpp"
#include "hm/sensors/laser_scan.hpp"

namespace hm::laser_testing {

struct Segment {
  Vec2 a, b;
};
struct Circle {
  Vec2 centre;
  double radius_m;
};

/// Planar world of walls and round pillars with exact ranges.
struct PlanarWorld {
  std::vector<Segment> segments;
  std::vector<Circle> circles;

  /// Adds walls along a closed polygon.
  void add_polygon(std::span<const Vec2> corners);
  void add_box(const Vec2& low, const Vec2& high);
  /// Distance from `origin` along the unit `direction` to the first surface; infinite when there is none.
  [[nodiscard]] double range(const Vec2& origin, const Vec2& direction) const;
};

/// Range finder that measures all beams at the same time.
struct TestLaser {
  std::size_t beams = 1081;
  double field_of_view_rad = 4.71238898038469;  // 270 degrees
  double range_max_m = 30, range_sigma_m = 0;
};

/// Simulates a scan from T_world_laser, with Gaussian range noise.
LaserScan scan_world(const PlanarWorld& world, const SE2& T_world_laser, const TestLaser& laser, Rng& rng);
/// The same as points in the laser frame.
PlanarScan planar_scan_of_world(const PlanarWorld& world, const SE2& T_world_laser, const TestLaser& laser,
                                Rng& rng);

/// Pose on a rectangle with rounded corners, `distance_m` after its start, facing forward: to the left of
/// `start`, which is the begin of its first side. `straight_m`: lengths of the straight parts of two sides.
SE2 rounded_rectangle(const SE2& start, const Vec2& straight_m, double radius_m, double distance_m);

/// One floor of an office, 16 m x 12 m: a corridor around a core, doors, niches, pillars; the loop of
/// `office_loop` runs through the corridor.
PlanarWorld office_world();
/// Pose on a closed, rounded loop of 41.7 m through the corridor of `office_world`, `distance_m` after its
/// start, facing forward.
SE2 office_loop(double distance_m);
inline constexpr double kOfficeLoop_m = 41.7;
/// A corridor along x, 2.4 m wide, from -10 m to 10 m beyond `length_m`; doors stand back by `niche_m` at
/// uneven distances on both sides.
PlanarWorld corridor_world(double length_m, double niche_m);
/// A room of 8 m x 6 m with a niche and a pillar.
PlanarWorld room_world();

}  // namespace hm::laser_testing
