#pragma once
#include <Eigen/Geometry>
#include <vector>

#include "hm/sensors/imu.hpp"
#include "hm/sensors/laser_rig.hpp"
#include "hm/sensors/laser_scan.hpp"

namespace hm {

/// Surface that a mirror points at. A ceiling is treated as a floor with the vertical axis inverted.
enum class SurfaceSide { kFloor, kCeiling };

/// Attitude of the vehicle during one sweep, interpolated (slerp) between two times and constant outside
/// them. Yaw is irrelevant.
struct SweepAttitude {
  Time begin, end;
  Eigen::Quaterniond R_world_base_begin = Eigen::Quaterniond::Identity();
  Eigen::Quaterniond R_world_base_end = Eigen::Quaterniond::Identity();

  /// One attitude for the whole sweep.
  static SweepAttitude constant(const Mat3& R_world_base);
  [[nodiscard]] Eigen::Quaterniond at(Time time) const;
  [[nodiscard]] bool is_finite() const;
};

/// Vertical distances measured by one scan through one mirror.
struct MirrorDistances {
  Time stamp;                       ///< of the mirror's middle beam
  std::vector<double> distances_m;  ///< along gravity, from base to surface (down or up), in beam order
  double tilt_rad = 0;              ///< between the base's z axis and the vertical at `stamp`
};

/// Computes the vertical distances of the mirrored beams of a scan; every end point is rotated by the
/// attitude at the beam's own time (dissertation 2.2.3; 2.2.2 for the transforms). Beams without a return,
/// readings on the wrong side of the base and beam indices beyond the scan are ignored. Non-finite attitudes
/// give no distances and a NaN tilt.
MirrorDistances mirror_distances(const LaserScan& scan, const LaserRig::Mirror& mirror,
                                 const SweepAttitude& attitude, SurfaceSide side);

/// The same for a downward range sensor (along its own x axis), for vehicles without a mirror: one distance,
/// or none if the reading is outside its limits or the sensor points upwards. Use with
/// HeightParams::for_range_sensor(). A non-finite attitude or mounting gives no distance and a NaN tilt.
MirrorDistances range_distance(const RangeReading& reading, const SE3& T_base_sensor,
                               const Mat3& R_world_base);

}  // namespace hm
