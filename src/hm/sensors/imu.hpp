#pragma once
#include <optional>
#include <string>
#include <vector>

#include "hm/core/time.hpp"
#include "hm/geometry/se3.hpp"

namespace hm {

inline constexpr double kGravity_m_s2 = 9.80665;

/// One reading of an inertial measurement unit, in the `imu` frame (x forward, y left, z up where the
/// recording's rig says nothing else).
struct ImuSample {
  Time stamp;
  Vec3 angular_velocity_rad_s = Vec3::Zero();
  Vec3 specific_force_m_s2 = Vec3::Zero();  ///< what accelerometers feel: (0, 0, +g) at rest and level
  std::optional<Mat3> R_world_imu;          ///< orientation by the device's own filter, if it has one
};

/// What an inertial device felt that was carried with a camera.
struct CarriedImu {
  std::vector<ImuSample> samples;  ///< in the CAMERA's frame (x right, y down, z forward), in order of time
  bool has_gyroscope = false;      ///< without one the angular velocities are zero and mean nothing
  std::string source;              ///< the file they come from
};

/// One reading of a distance sensor that looks along the x axis of its frame (sonar, downward laser).
struct RangeReading {
  Time stamp;
  double range_m = 0;
  double range_min_m = 0, range_max_m = 0;
};

}  // namespace hm
