#include "hm/laser/testing/ring_corridor.hpp"

#include <cmath>
#include <numbers>

namespace hm::laser_testing {
namespace {

constexpr double kLength_m = 36, kWidth_m = 24, kCorridor_m = 2.4, kDoor_m = 1;
constexpr double kRadius_m = 1.2;

/// A wall from the origin of a frame along its x axis, with doors; rooms lie to its right (-y).
void add_wall_with_rooms(PlanarWorld& world, const SE2& T_world_wall, double length_m, double max_depth_m,
                         Rng& rng) {
  const auto add = [&](const Vec2& a, const Vec2& b) {
    world.segments.push_back({T_world_wall * a, T_world_wall * b});
  };
  double at = 0;
  while (length_m - at > 5) {
    const double room_m = 3 + rng.uniform(0, 2), depth_m = max_depth_m * rng.uniform(0.5, 1);
    const double door = at + rng.uniform(0.3, room_m - kDoor_m - 0.3);
    add({at, 0}, {door, 0});
    add({door + kDoor_m, 0}, {at + room_m, 0});
    const Vec2 corners[] = {
        {at + 0.1, 0}, {at + 0.1, -depth_m}, {at + room_m - 0.1, -depth_m}, {at + room_m - 0.1, 0}};
    for (int i = 0; i < 3; ++i) add(corners[i], corners[i + 1]);
    world.circles.push_back({T_world_wall * Vec2(at + rng.uniform(0.8, room_m - 0.8), -0.7 * depth_m), 0.25});
    at += room_m;
  }
  add({at, 0}, {length_m, 0});
}

}  // namespace

PlanarWorld ring_corridor_world() {
  PlanarWorld world;
  Rng rng(36);
  constexpr double kCoreLength_m = kLength_m - 2 * kCorridor_m, kCoreWidth_m = kWidth_m - 2 * kCorridor_m;
  constexpr double kQuarter = std::numbers::pi / 2;
  const SE2 outer[] = {
      {0, 0, 0}, {kLength_m, 0, kQuarter}, {kLength_m, kWidth_m, 2 * kQuarter}, {0, kWidth_m, -kQuarter}};
  for (int side = 0; side < 4; ++side)
    add_wall_with_rooms(world, outer[side], side % 2 == 0 ? kLength_m : kWidth_m, 5, rng);
  // Around the core the other way, so that its rooms lie inside.
  const double low = kCorridor_m, right = kLength_m - kCorridor_m, top = kWidth_m - kCorridor_m;
  const SE2 core[] = {
      {low, low, kQuarter}, {low, top, 0}, {right, top, -kQuarter}, {right, low, 2 * kQuarter}};
  for (int side = 0; side < 4; ++side)
    add_wall_with_rooms(world, core[side], side % 2 == 0 ? kCoreWidth_m : kCoreLength_m, 4, rng);
  return world;
}

SE2 ring_corridor_pose(double distance_m) {
  const Vec2 straight_m(kLength_m - kCorridor_m - 2 * kRadius_m, kWidth_m - kCorridor_m - 2 * kRadius_m);
  const double round_m = 2 * (straight_m.sum() + std::numbers::pi * kRadius_m);
  return rounded_rectangle({kCorridor_m / 2 + kRadius_m, kCorridor_m / 2, 0}, straight_m, kRadius_m,
                           std::fmod(distance_m, round_m));
}

}  // namespace hm::laser_testing
