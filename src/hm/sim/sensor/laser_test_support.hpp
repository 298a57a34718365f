#pragma once
#include <algorithm>
#include <cmath>
#include <optional>

#include "hm/sim/recording/laser_simulation.hpp"
#include "hm/sim/world/room_scene.hpp"

namespace hm::test {

/// Parameters without any errors.
inline LaserSimulationParams perfect(WorldKind world) {
  LaserSimulationParams params;
  params.world = world;
  params.make_perfect();
  return params;
}

/// Ray of a beam in the world.
inline Ray beam_ray(const LaserSimulation& simulation, const LaserScan& scan, std::size_t beam) {
  const LaserRig& rig = simulation.rig();
  const SE3* mount = &rig.T_base_laser;
  if (beam < rig.down->beams.end) mount = &rig.down->T_base_virtual_laser;
  if (beam >= rig.up->beams.begin) mount = &rig.up->T_base_virtual_laser;
  const SE3 pose = simulation.state_at(scan.stamp_of(beam)).T_world_base * *mount;
  const double angle = scan.angle_rad(beam);
  return {pose.translation(), pose.rotation() * Vec3(std::cos(angle), std::sin(angle), 0), 0};
}

/// Distance to the wall from inside an axis-aligned box.
inline double box_range(const Ray& ray, const Vec3& low, const Vec3& high) {
  double nearest = 1e9;
  for (int i = 0; i < 3; ++i) {
    if (std::abs(ray.direction_world[i]) < 1e-12) continue;
    const double wall = ray.direction_world[i] > 0 ? high[i] : low[i];
    nearest = std::min(nearest, (wall - ray.origin_world[i]) / ray.direction_world[i]);
  }
  return nearest;
}

/// Distance to the room's analytic solids, by sphere tracing; nothing for a ray tangential to one.
inline std::optional<double> traced_range(const Ray& ray) {
  double along = 0;
  for (int i = 0; i < 5000; ++i) {
    const double distance = room_sdf(ray.origin_world + along * ray.direction_world);
    if (distance < 1e-9) return along;
    along += distance;
  }
  return {};
}

/// True for points on a sphere, which is tessellated in the mesh.
inline bool is_on_sphere(const Vec3& p) {
  return std::ranges::any_of(room_primitives(), [&](const RoomPrimitive& primitive) {
    return primitive.shape == RoomShape::kSphere && primitive_sdf(primitive, p) < 0.02;
  });
}

inline bool same(const LaserScan& a, const LaserScan& b) {
  return a.stamp == b.stamp && a.time_increment_s == b.time_increment_s &&
         std::equal(a.ranges_m.begin(), a.ranges_m.end(), b.ranges_m.begin(), b.ranges_m.end(),
                    [](float x, float y) { return x == y || (std::isnan(x) && std::isnan(y)); });
}

}  // namespace hm::test
