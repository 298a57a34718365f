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

/// How a laser sits on its vehicle, and which of its beams mirrors turn aside (dissertation 2.2, Fig. 2.1).
///
/// A mirrored beam is as if it came from a virtual laser behind the mirror: its end point is
/// T_base_mirror * (r cos(angle), r sin(angle), 0) with the beam's own angle.
struct LaserRig {
  /// A mirror: the beams that it turns, and the virtual laser's place.
  struct Mirror {
    BeamRange beams;
    SE3 T_base_virtual_laser;
  };

  SE3 T_base_laser;
  SE3 T_base_imu;
  std::optional<BeamRange> horizontal;  ///< beams that leave in the scan plane; none: all
  std::optional<Mirror> down, up;       ///< towards the floor, towards the ceiling

  /// The beams of the scan plane of a scan with `size` beams.
  [[nodiscard]] BeamRange horizontal_beams(std::size_t size) const {
    return horizontal ? BeamRange{std::min(horizontal->begin, size), std::min(horizontal->end, size)}
                      : BeamRange{0, size};
  }
};

/// What a vehicle carries.
struct LaserPlatform {
  std::vector<LaserRig> rigs;  ///< one for each laser; the first is the one that is matched
  bool has_imu = false, has_odometry = false;
};

}  // namespace hm
