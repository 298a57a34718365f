#pragma once
#include <algorithm>
#include <cstddef>
#include <optional>
#include <vector>

#include "hm/geometry/se3.hpp"

namespace hm {

/// Consecutive beams of a scan: [begin, end).
struct BeamRange {
  std::size_t begin = 0, end = 0;
  [[nodiscard]] std::size_t size() const { return end - begin; }
};

/// Mounting of a laser on its vehicle, and the beams deflected by mirrors (dissertation 2.2, Fig. 2.1).
///
/// A mirrored beam is equivalent to one from a virtual laser behind the mirror: its end point is
/// T_base_mirror * (r cos(angle), r sin(angle), 0) with the beam's own angle.
struct LaserRig {
  /// Mirror: the beams that it deflects, and the pose of the virtual laser.
  struct Mirror {
    BeamRange beams;
    SE3 T_base_virtual_laser;
  };

  SE3 T_base_laser;
  SE3 T_base_imu;
  std::optional<BeamRange> horizontal;  ///< beams in the scan plane; unset: all
  std::optional<Mirror> down, up;       ///< towards the floor, towards the ceiling
  std::optional<SE3> T_base_range;      ///< of a range sensor, which looks along its own x axis

  /// Beams in the scan plane, for a scan with `size` beams.
  [[nodiscard]] BeamRange horizontal_beams(std::size_t size) const {
    return horizontal ? BeamRange{std::min(horizontal->begin, size), std::min(horizontal->end, size)}
                      : BeamRange{0, size};
  }
};

/// Sensors of a vehicle.
struct LaserPlatform {
  std::vector<LaserRig> rigs;  ///< one per laser; scan matching uses the first
  bool has_imu = false, has_odometry = false;
};

}  // namespace hm
