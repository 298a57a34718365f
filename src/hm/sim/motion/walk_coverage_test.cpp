// Share of the visible surface in the house's rooms that the walk observes.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "hm/core/rng.hpp"
#include "hm/sim/motion/walk.hpp"
#include "hm/sim/sensor/depth_sensor.hpp"
#include "hm/sim/sensor/renderer.hpp"
#include "hm/sim/world/house_plan.hpp"
#include "hm/sim/world/world.hpp"

namespace hm {
namespace {

constexpr double kSpacing_m = 0.12;  ///< one sample for its square of surface
constexpr double kGrazingLimit_rad = 1.36;
constexpr double kMargin_m = 0.002;
constexpr double kClearance_m = 0.2;  ///< as the walk keeps
constexpr double kFar_m = 4.0;        ///< farther is not used by a reconstruction

enum Kind : std::size_t { kFloor, kCeiling, kUpright, kOther, kKinds };
constexpr std::array<const char*, kKinds> kKindNames = {"floor", "ceiling", "upright", "other"};

struct Sample {
  Vec3 position, normal;
  [[nodiscard]] Kind kind() const {
    if (normal.z() > 0.9 && position.z() < 0.02) return kFloor;
    if (normal.z() < -0.9 && position.z() > kHouseHeight_m - 0.02) return kCeiling;
    return std::abs(normal.z()) < 0.1 ? kUpright : kOther;
  }
};

/// Samples of all surfaces that return, uniform by area.
std::vector<Sample> surface_samples(const World& world) {
  std::vector<Sample> samples;
  Rng rng(3);
  for (const WorldPart& part : world.parts) {
    if (part.material.reflectance != Reflectance::kNormal) continue;
    for (const auto& t : part.mesh.triangles) {
      const Vec3 a = part.mesh.vertices[t[0]].cast<double>(), b = part.mesh.vertices[t[1]].cast<double>(),
                 c = part.mesh.vertices[t[2]].cast<double>();
      const Vec3 cross = (b - a).cross(c - a);
      double due = 0.5 * cross.norm() / (kSpacing_m * kSpacing_m);
      for (; due > 0 && rng.uniform() < due; due -= 1) {
        const double root = std::sqrt(rng.uniform()), v = rng.uniform();
        samples.push_back({(1 - root) * a + root * (1 - v) * b + root * v * c, cross.normalized()});
      }
    }
  }
  return samples;
}

/// The rooms and the hallway.
std::vector<RoomPlan> all_rooms() {
  std::vector<RoomPlan> rooms = house_rooms();
  RoomPlan hall = rooms.front();
  hall.name = "hall", hall.x0 = 0, hall.x1 = kHouseLength_m, hall.y0 = kHallLow_y, hall.y1 = kHallHigh_y;
  hall.door_x = 10;
  rooms.push_back(hall);
  return rooms;
}

/// Points of a 0.4 m grid that a person can reach from the door without touching anything.
std::vector<Vec2> reachable_in(const RoomPlan& room, const Renderer& renderer) {
  const auto is_clear = [&](const Vec2& p) {
    return std::ranges::all_of(std::array{0.5, 1.0, 1.5}, [&](double z) {
      return renderer.clearance_m({p.x(), p.y(), z}, 0.5) > kClearance_m;
    });
  };
  std::vector<Vec2> places;
  for (double x = room.x0 + 0.3; x < room.x1; x += 0.4)
    for (double y = room.y0 + 0.3; y < room.y1; y += 0.4)
      if (is_clear({x, y})) places.emplace_back(x, y);
  const Vec2 door(room.door_x, kHallCenter_y);
  const auto reached_end = [&](std::size_t done) {  // moves what is next to a reached place to the front
    std::size_t reached = done;
    for (std::size_t from = 0; from < reached; ++from)
      for (std::size_t to = reached; to < places.size(); ++to)
        if ((places[to] - places[from]).norm() < 0.6 && is_clear((places[to] + places[from]) / 2))
          std::swap(places[to], places[reached++]);
    return reached;
  };
  std::iter_swap(places.begin(), std::ranges::min_element(
                                     places, {}, [&](const Vec2& p) { return (p - door).squaredNorm(); }));
  places.resize(reached_end(1));
  return places;
}

/// Possible eye positions of a person walking in a room.
std::vector<Vec3> eyes_in(const RoomPlan& room, const Renderer& renderer) {
  std::vector<Vec3> eyes;
  for (const Vec2& place : reachable_in(room, renderer))
    for (const double height : {1.4, 1.5, 1.6}) eyes.emplace_back(place.x(), place.y(), height);
  return eyes;
}

struct Viewer {
  const Renderer& renderer;
  SensorModel sensor = sensor_model(SensorPreset::kTangoTablet);

  [[nodiscard]] bool could_see(const Vec3& eye, const Sample& s) const {
    const Vec3 to_eye = eye - s.position;
    const double range = to_eye.norm();
    return range > sensor.min_depth_m && range < kFar_m &&
           s.normal.dot(to_eye) > std::cos(kGrazingLimit_rad) * range &&
           renderer.is_free(eye, s.position, kMargin_m);
  }
  [[nodiscard]] bool sees(const SE3& T_world_camera, const Sample& s) const {
    const Vec3 ray = s.position - T_world_camera.translation();
    const double z = T_world_camera.rotation().col(2).dot(ray);
    if (z < sensor.min_depth_m || z > kFar_m) return false;
    if (s.normal.dot(ray) > -std::cos(kGrazingLimit_rad) * ray.norm()) return false;
    const Vec2 pixel = sensor.camera.project(T_world_camera.rotation().transpose() * ray);
    return sensor.camera.contains(pixel) &&
           renderer.is_free(T_world_camera.translation(), s.position, kMargin_m);
  }
};

/// Samples visible from this room.
std::vector<Sample> seeable_in(const RoomPlan& room, const std::vector<Sample>& samples,
                               const Viewer& viewer) {
  const std::vector<Vec3> eyes = eyes_in(room, viewer.renderer);
  constexpr double kInto_m = 0.05;
  std::vector<Sample> seeable;
  for (const Sample& s : samples) {
    if (s.position.x() < room.x0 - kInto_m || s.position.x() > room.x1 + kInto_m ||
        s.position.y() < room.y0 - kInto_m || s.position.y() > room.y1 + kInto_m)
      continue;
    if (std::any_of(eyes.begin(), eyes.end(), [&](const Vec3& eye) { return viewer.could_see(eye, s); }))
      seeable.push_back(s);
  }
  return seeable;
}

struct Count {
  std::size_t seen = 0, all = 0;
  void add(bool is_seen) { seen += is_seen, ++all; }
  [[nodiscard]] double ratio() const {
    return all == 0 ? 1.0 : static_cast<double>(seen) / static_cast<double>(all);
  }
};

/// The largest unseen area within 30 cm of any unseen point.
double largest_gap_m2(const std::vector<Vec3>& unseen) {
  std::ptrdiff_t most = 0;
  for (const Vec3& p : unseen)
    most = std::max(most, std::count_if(unseen.begin(), unseen.end(),
                                        [&](const Vec3& q) { return (p - q).norm() < 0.3; }));
  return static_cast<double>(most) * kSpacing_m * kSpacing_m;
}

TEST(WalkCoverage, TheHouseWalkSeesNearlyAllThatAPersonCouldSee) {
  const World house = make_house(1);
  const Renderer renderer(house);
  const Viewer viewer{renderer};
  const Walk walk = house_walk();
  std::vector<SE3> poses;
  for (double t = 0; t < walk.duration_s(); t += 0.2) poses.push_back(walk.T_world_camera(t));
  const std::vector<Sample> samples = surface_samples(house);

  Count all;
  std::array<Count, kKinds> by_kind;
  std::vector<Vec3> unseen;
  for (const RoomPlan& room : all_rooms()) {
    Count in_room;
    std::array<Count, kKinds> kinds_in_room;
    for (const Sample& s : seeable_in(room, samples, viewer)) {
      const bool seen =
          std::any_of(poses.begin(), poses.end(), [&](const SE3& pose) { return viewer.sees(pose, s); });
      if (!seen) unseen.push_back(s.position);
      all.add(seen), in_room.add(seen), by_kind[s.kind()].add(seen), kinds_in_room[s.kind()].add(seen);
    }
    RecordProperty(room.name, std::to_string(in_room.ratio()));
    EXPECT_GT(in_room.all, 1000U) << room.name;  // 14 m2: the rooms are there
    EXPECT_GT(in_room.ratio(), 0.96) << room.name;
    EXPECT_GT(kinds_in_room[kFloor].ratio(), 0.98) << room.name;
  }
  for (std::size_t k = 0; k < kKinds; ++k) RecordProperty(kKindNames[k], std::to_string(by_kind[k].ratio()));
  RecordProperty("all", std::to_string(all.ratio()));
  RecordProperty("largest_gap_m2", std::to_string(largest_gap_m2(unseen)));
  EXPECT_GT(all.ratio(), 0.975);
  EXPECT_GT(by_kind[kFloor].ratio(), 0.99);
  EXPECT_GT(by_kind[kCeiling].ratio(), 0.995);
  EXPECT_GT(by_kind[kUpright].ratio(), 0.97);
  EXPECT_LT(largest_gap_m2(unseen), 0.35);
}

}  // namespace
}  // namespace hm
