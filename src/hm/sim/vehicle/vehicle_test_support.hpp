#pragma once
#include <cmath>
#include <string_view>
#include <vector>

#include "hm/sim/vehicle/vehicle.hpp"

namespace hm::test {

/// Setup without disturbances and sensor errors, in the air.
inline VehicleSetup calm_vehicle(const Vec3& position = Vec3(0, 0, 2)) {
  VehicleSetup setup;
  setup.params.make_perfect();
  setup.imu_effects = {false, false, false};
  setup.T_world_base = SE3(Mat3::Identity(), position);
  return setup;
}

inline VehicleCommand rotors_at(double speed_rad_s) {
  VehicleCommand command;
  command.rotor_speed_rad_s.setConstant(speed_rad_s);
  return command;
}

/// Rays into planes that face the free space.
inline CastRays cast_into_planes(std::vector<SurfacePlane> planes) {
  return [planes](std::span<const Ray> rays, std::span<RayHit> hits) {
    for (std::size_t i = 0; i < rays.size(); ++i) {
      hits[i] = {};
      for (const SurfacePlane& plane : planes) {
        const double along = plane.normal_world.dot(rays[i].direction_world);
        const double range = plane.normal_world.dot(plane.point_world - rays[i].origin_world) / along;
        if (along < -1e-12 && range >= 0 && range < hits[i].range_m) hits[i] = {range, plane.normal_world, 0};
      }
    }
  };
}

inline CastRays cast_into_floor() { return cast_into_planes({SurfacePlane{}}); }

inline FaultSchedule faults_of(std::string_view script) {
  return FaultSchedule::parse(script, "script").value();
}

}  // namespace hm::test
