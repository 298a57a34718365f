#include "hm/laser/testing/planar_world.hpp"

#include <cmath>
#include <limits>
#include <numbers>

namespace hm::laser_testing {
namespace {

double cross(const Vec2& a, const Vec2& b) { return a.x() * b.y() - a.y() * b.x(); }

double range_to(const Segment& segment, const Vec2& origin, const Vec2& direction) {
  const Vec2 along = segment.b - segment.a, offset = segment.a - origin;
  const double determinant = cross(direction, along);
  const double range = cross(offset, along) / determinant, place = cross(offset, direction) / determinant;
  return range > 0 && place >= 0 && place <= 1 ? range : std::numeric_limits<double>::infinity();
}

double range_to(const Circle& circle, const Vec2& origin, const Vec2& direction) {
  const Vec2 offset = origin - circle.centre;
  const double b = offset.dot(direction), c = offset.squaredNorm() - circle.radius_m * circle.radius_m;
  const double discriminant = b * b - c;
  if (discriminant < 0) return std::numeric_limits<double>::infinity();
  const double root = std::sqrt(discriminant);
  if (-b - root > 0) return -b - root;
  return -b + root > 0 ? -b + root : std::numeric_limits<double>::infinity();
}

}  // namespace

void PlanarWorld::add_polygon(std::span<const Vec2> corners) {
  for (std::size_t i = 0; i < corners.size(); ++i)
    segments.push_back({corners[i], corners[(i + 1) % corners.size()]});
}

void PlanarWorld::add_box(const Vec2& low, const Vec2& high) {
  const Vec2 corners[] = {low, {high.x(), low.y()}, high, {low.x(), high.y()}};
  add_polygon(corners);
}

double PlanarWorld::range(const Vec2& origin, const Vec2& direction) const {
  double nearest = std::numeric_limits<double>::infinity();
  for (const Segment& segment : segments) nearest = std::min(nearest, range_to(segment, origin, direction));
  for (const Circle& circle : circles) nearest = std::min(nearest, range_to(circle, origin, direction));
  return nearest;
}

LaserScan scan_world(const PlanarWorld& world, const SE2& T_world_laser, const TestLaser& laser, Rng& rng) {
  LaserScan scan;
  scan.angle_min_rad = -laser.field_of_view_rad / 2;
  scan.angle_increment_rad = laser.field_of_view_rad / static_cast<double>(laser.beams - 1);
  scan.range_min_m = 0.05;
  scan.range_max_m = laser.range_max_m;
  for (std::size_t i = 0; i < laser.beams; ++i) {
    const double angle = T_world_laser.angle() + scan.angle_rad(i);
    const double range = world.range(T_world_laser.translation(), {std::cos(angle), std::sin(angle)});
    const double measured = range + (laser.range_sigma_m > 0 ? rng.normal(0, laser.range_sigma_m) : 0.0);
    scan.ranges_m.push_back(measured < laser.range_max_m ? static_cast<float>(measured)
                                                         : LaserScan::kNoReturn);
  }
  return scan;
}

PlanarScan planar_scan_of_world(const PlanarWorld& world, const SE2& T_world_laser, const TestLaser& laser,
                                Rng& rng) {
  const LaserScan scan = scan_world(world, T_world_laser, laser, rng);
  PlanarScan points;
  for (std::size_t i = 0; i < scan.size(); ++i) {
    if (!scan.is_return(i)) continue;
    const double angle = scan.angle_rad(i), range = static_cast<double>(scan.ranges_m[i]);
    points.points_m.emplace_back(range * std::cos(angle), range * std::sin(angle));
    points.bearings_rad.push_back(static_cast<float>(angle));
    points.ranges_m.push_back(scan.ranges_m[i]);
  }
  return points;
}

PlanarWorld room_world() {
  PlanarWorld world;
  const Vec2 corners[] = {{-4, -3}, {4, -3}, {4, 1}, {5, 1}, {5, 2}, {4, 2}, {4, 3}, {-4, 3}};
  world.add_polygon(corners);
  world.circles.push_back({{-2.2, 1.4}, 0.25});
  return world;
}

PlanarWorld office_world() {
  PlanarWorld world;
  // Outer walls with niches and two rooms behind open doors.
  const Vec2 outer[] = {{0, 0},      {5, 0},      {5, -0.4},   {6.2, -0.4}, {6.2, 0},   {10, 0},
                        {10, -3},    {13.5, -3},  {13.5, 0},   {16, 0},     {16, 4.5},  {16.5, 4.5},
                        {16.5, 6.3}, {16, 6.3},   {16, 11.8},  {10, 11.8},  {10, 12.3}, {8.8, 12.3},
                        {8.8, 11.8}, {4.5, 11.8}, {4.5, 14.8}, {1, 14.8},   {1, 11.8},  {0, 11.8},
                        {0, 8.2},    {-0.5, 8.2}, {-0.5, 6.9}, {0, 6.9}};
  world.add_polygon(outer);
  // The core, with recesses.
  const Vec2 core[] = {{2.8, 3.1},  {6.5, 3.1},  {6.5, 3.7},  {7.6, 3.7},  {7.6, 3.1},  {13.2, 3.1},
                       {13.2, 5.4}, {12.6, 5.4}, {12.6, 6.5}, {13.2, 6.5}, {13.2, 8.7}, {9, 8.7},
                       {9, 8.0},    {7.7, 8.0},  {7.7, 8.7},  {2.8, 8.7}};
  world.add_polygon(core);
  for (const Vec2& pillar : {Vec2(0.4, 3.0), Vec2(15.5, 2.2), Vec2(12.0, 11.4), Vec2(6.0, 11.4)})
    world.circles.push_back({pillar, 0.2});
  world.add_box({8.2, 0.05}, {9.3, 0.5});
  world.add_box({0.1, 9.3}, {0.5, 10.2});
  return world;
}

SE2 office_loop(double distance_m) {
  // A rectangle with rounded corners in the middle of the corridor, of the stated length.
  constexpr double kRadius_m = 1.2, kWidth_m = 13.2;
  constexpr double kHeight_m =
      (kOfficeLoop_m - 2 * std::numbers::pi * kRadius_m) / 2 - (kWidth_m - 2 * kRadius_m) + 2 * kRadius_m;
  const Vec2 straight_m(kWidth_m - 2 * kRadius_m, kHeight_m - 2 * kRadius_m);
  return rounded_rectangle({8.0 - straight_m.x() / 2, 5.9 - kHeight_m / 2, 0}, straight_m, kRadius_m,
                           std::fmod(distance_m, kOfficeLoop_m));
}

SE2 rounded_rectangle(const SE2& start, const Vec2& straight_m, double radius_m, double distance_m) {
  const double arc = std::numbers::pi / 2 * radius_m;
  double left = distance_m;
  SE2 pose = start;
  for (int side = 0;; ++side) {
    const double straight = straight_m[side % 2];
    if (left <= straight) return pose * SE2(left, 0, 0);
    pose = pose * SE2(straight, 0, 0);
    left -= straight;
    if (left <= arc) return pose * SE2::exp({left, 0, left / radius_m});
    pose = pose * SE2::exp({arc, 0, arc / radius_m});
    left -= arc;
  }
}

PlanarWorld corridor_world(double length_m, double niche_m) {
  PlanarWorld world;
  Rng rng(5);
  for (const double side : {-1.0, 1.0}) {
    std::vector<Vec2> corners{{-10, side * 1.2}};
    for (double x = -9; x < length_m; x += 2 + 4 * rng.uniform())
      for (const auto& [along, back] : {std::pair{0.0, 0.0}, {0.0, niche_m}, {0.95, niche_m}, {0.95, 0.0}})
        corners.emplace_back(x + along, side * (1.2 + back));
    corners.emplace_back(length_m + 10, side * 1.2);
    for (std::size_t i = 1; i < corners.size(); ++i) world.segments.push_back({corners[i - 1], corners[i]});
  }
  return world;
}

}  // namespace hm::laser_testing
