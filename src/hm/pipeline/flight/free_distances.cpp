#include "hm/pipeline/flight/free_distances.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "hm/geometry/se2.hpp"

namespace hm {
namespace {

constexpr double kSector_rad = 2 * std::numbers::pi / FreeDistances::kDirections;
constexpr double kFloorMargin_m = 0.15;

/// End points of a scan's horizontal beams within `most_m`, in the level frame of the vehicle, without those
/// on the floor.
std::vector<Vec2> obstacle_points(const LaserScan& scan, const LaserRig& rig, const HullPose& hull,
                                  double most_m) {
  const SE3 T_level_laser =
      SE3(rotation_from_roll_pitch_yaw({hull.roll_rad, hull.pitch_rad, 0}), Vec3::Zero()) * rig.T_base_laser;
  const BeamRange beams = rig.horizontal_beams(scan.size());
  std::vector<Vec2> points;
  for (std::size_t beam = beams.begin; beam < beams.end; ++beam) {
    if (!scan.is_return(beam)) continue;
    const auto range_m = static_cast<double>(scan.ranges_m[beam]);
    if (range_m > most_m) continue;
    const double angle = scan.angle_rad(beam);
    const Vec3 point = T_level_laser * Vec3(range_m * std::cos(angle), range_m * std::sin(angle), 0);
    if (hull.height_m + point.z() > kFloorMargin_m) points.emplace_back(point.head<2>());
  }
  return points;
}

}  // namespace

std::optional<double> FreeDistances::towards(double angle_rad) const {
  const auto sector = std::lround(angle_rad / kSector_rad);
  constexpr auto kCount = static_cast<long>(kDirections);
  const auto index = static_cast<std::size_t>((sector % kCount + kCount) % kCount);
  if (units[index] == kNothing) return std::nullopt;
  return kUnit_m * units[index];
}

FreeDistances free_distances(const LaserScan& scan, const LaserRig& rig, const HullPose& hull) {
  constexpr double kMost_m = FreeDistances::kUnit_m * FreeDistances::kNothing;
  const std::vector<Vec2> points = obstacle_points(scan, rig, hull, kMost_m + hull.radius_m);
  FreeDistances free;
  for (std::size_t i = 0; i < FreeDistances::kDirections; ++i) {
    const double angle = kSector_rad * static_cast<double>(i);
    const Vec2 ahead(std::cos(angle), std::sin(angle));
    double nearest_m = kMost_m;
    for (const Vec2& point : points) {
      const double along_m = point.dot(ahead);
      const double across_m = ahead.x() * point.y() - ahead.y() * point.x();
      if (along_m > 0 && std::abs(across_m) < hull.radius_m) nearest_m = std::min(nearest_m, along_m);
    }
    free.units[i] = static_cast<std::uint8_t>(nearest_m / FreeDistances::kUnit_m);
  }
  return free;
}

}  // namespace hm
