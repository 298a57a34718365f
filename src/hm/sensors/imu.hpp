#pragma once
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "hm/core/time.hpp"
#include "hm/geometry/se3.hpp"

namespace hm {

inline constexpr double kGravity_m_s2 = 9.80665;

/// One IMU measurement in the `imu` frame (x forward, y left, z up unless the recording's rig defines it
/// otherwise).
struct ImuSample {
  Time stamp;
  Vec3 angular_velocity_rad_s = Vec3::Zero();
  Vec3 specific_force_m_s2 = Vec3::Zero();  ///< as accelerometers measure: (0, 0, +g) at rest and level
  std::optional<Mat3> R_world_imu;          ///< orientation by the device's own filter, if it has one

  template <class Archive>
  void visit_state(Archive& archive) {
    archive(stamp, angular_velocity_rad_s, specific_force_m_s2, R_world_imu);
  }
};

/// Measurements of an IMU rigidly mounted to a camera.
struct CarriedImu {
  std::vector<ImuSample> samples;  ///< in the CAMERA's frame (x right, y down, z forward), in order of time
  bool has_gyroscope = false;      ///< if false, the angular velocities are zero and unused
  std::string source;              ///< file name
};

/// One measurement of a range sensor that points along the x axis of its frame (sonar, downward laser).
struct RangeReading {
  Time stamp;
  double range_m = 0;                       ///< infinity: no return
  double range_min_m = 0, range_max_m = 0;  ///< limits of the sensor; a maximum of 0: not known

  /// A finite range within the limits.
  [[nodiscard]] bool is_return() const {
    return std::isfinite(range_m) && range_m >= range_min_m && (!(range_max_m > 0) || range_m <= range_max_m);
  }
};

}  // namespace hm
