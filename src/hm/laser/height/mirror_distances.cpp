#include "hm/laser/height/mirror_distances.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hm {

SweepAttitude SweepAttitude::constant(const Mat3& R_world_base) {
  const Eigen::Quaterniond attitude(R_world_base);
  return {{}, {}, attitude, attitude};
}

Eigen::Quaterniond SweepAttitude::at(Time time) const {
  const double span_s = (end - begin).seconds();
  if (span_s <= 0) return R_world_base_begin;
  const double fraction = std::clamp((time - begin).seconds() / span_s, 0.0, 1.0);
  return R_world_base_begin.slerp(fraction, R_world_base_end);
}

bool SweepAttitude::is_finite() const {
  return R_world_base_begin.coeffs().allFinite() && R_world_base_end.coeffs().allFinite();
}

MirrorDistances mirror_distances(const LaserScan& scan, const LaserRig::Mirror& mirror,
                                 const SweepAttitude& attitude, SurfaceSide side) {
  const std::size_t begin = std::min(mirror.beams.begin, scan.size());
  const std::size_t end = std::clamp(mirror.beams.end, begin, scan.size());
  MirrorDistances result;
  result.stamp = scan.stamp_of((begin + end) / 2);
  if (!attitude.is_finite()) {
    result.tilt_rad = std::numeric_limits<double>::quiet_NaN();
    return result;
  }
  const Vec3 up_base = attitude.at(result.stamp).conjugate() * Vec3::UnitZ();
  result.tilt_rad = std::acos(std::clamp(up_base.z(), -1.0, 1.0));
  result.distances_m.reserve(end - begin);
  const double sign = side == SurfaceSide::kFloor ? -1 : 1;
  for (std::size_t beam = begin; beam < end; ++beam) {
    if (!scan.is_return(beam)) continue;
    const double range_m = static_cast<double>(scan.ranges_m[beam]), angle_rad = scan.angle_rad(beam);
    const Vec3 hit_base =
        mirror.T_base_virtual_laser * Vec3(range_m * std::cos(angle_rad), range_m * std::sin(angle_rad), 0);
    const double distance_m = sign * (attitude.at(scan.stamp_of(beam)) * hit_base).z();
    if (distance_m > 0) result.distances_m.push_back(distance_m);
  }
  return result;
}

MirrorDistances range_distance(const RangeReading& reading, const SE3& T_base_sensor,
                               const Mat3& R_world_base) {
  MirrorDistances result;
  result.stamp = reading.stamp;
  if (!R_world_base.allFinite() || !T_base_sensor.matrix().allFinite()) {
    result.tilt_rad = std::numeric_limits<double>::quiet_NaN();
    return result;
  }
  result.tilt_rad = std::acos(std::clamp(R_world_base(2, 2), -1.0, 1.0));
  if (!reading.is_return()) return result;
  const double distance_m = -(R_world_base * (T_base_sensor * Vec3(reading.range_m, 0, 0))).z();
  if (distance_m > 0) result.distances_m.push_back(distance_m);
  return result;
}

}  // namespace hm
