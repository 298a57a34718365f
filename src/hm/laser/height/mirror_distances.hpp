#pragma once
#include <Eigen/Geometry>
#include <vector>

#include "hm/sensors/imu.hpp"
#include "hm/sensors/laser_rig.hpp"
#include "hm/sensors/laser_scan.hpp"

namespace hm {

/// What a mirror looks at. A ceiling is a floor with the vertical axis turned over.
enum class SurfaceSide { kFloor, kCeiling };

/// The vehicle's attitude during one sweep: two moments of it, and the arc between them. Held, not
/// extrapolated, outside of them. Yaw does not matter here.
struct SweepAttitude {
  Time begin, end;
  Eigen::Quaterniond R_world_base_begin = Eigen::Quaterniond::Identity();
  Eigen::Quaterniond R_world_base_end = Eigen::Quaterniond::Identity();

  /// One attitude for the whole sweep.
  static SweepAttitude constant(const Mat3& R_world_base);
  [[nodiscard]] Eigen::Quaterniond at(Time time) const;
  [[nodiscard]] bool is_finite() const;
};

/// What one scan says through one mirror.
struct MirrorDistances {
  Time stamp;                       ///< of the mirror's middle beam
  std::vector<double> distances_m;  ///< along gravity, base to what the beam hit (down, or up); in beam order
  double tilt_rad = 0;              ///< between the base's z axis and the vertical at `stamp`
};

/// The vertical distances of the mirrored beams of a scan: every end point is turned by the attitude at the
/// beam's own time (dissertation 2.2.3; 2.2.2 for the transforms). Beams without a return, and readings on
/// the wrong side of the base, are left out. Beams outside of the scan do not exist. Not finite attitudes
/// give no distances and a NaN tilt.
MirrorDistances mirror_distances(const LaserScan& scan, const LaserRig::Mirror& mirror,
                                 const SweepAttitude& attitude, SurfaceSide side);

/// The vertical distance of a distance sensor that looks down (along its own x axis), for vehicles without a
/// mirror there: one distance, or none where the reading is out of its limits or looks up. For a
/// HeightEstimator with HeightParams::for_range_sensor(). A not finite attitude or mounting gives no distance
/// and a NaN tilt.
MirrorDistances range_distance(const RangeReading& reading, const SE3& T_base_sensor,
                               const Mat3& R_world_base);

}  // namespace hm
