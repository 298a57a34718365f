#pragma once
#include <filesystem>

#include "hm/core/result.hpp"
#include "hm/sensors/laser_rig.hpp"

namespace hm {

/// Reads where a laser sits and which of its beams mirrors turn aside, a TOML file:
///
///     [laser]                      # in the vehicle (base: x forward, y left, z up)
///     xyz_m = [0.0, 0.0, 0.12]
///     rpy_deg = [0.0, 0.0, 0.0]    # R = Rz(yaw) Ry(pitch) Rx(roll)
///     [imu]                        # the same, optional
///     [horizontal]                 # optional: the beams that no mirror turns and no part of the vehicle
///     hides beams = [56, 1024]           # from the first to before the last [down]                       #
///     optional mirrors: [down], [up] beams = [0, 20] xyz_m = [...]                # of the virtual laser
///     behind the mirror, in the laser's frame rpy_deg = [...]
///
/// A missing pose is zero. Errors name file and line: no TOML, an unknown key or table, a wrong type, numbers
/// that are not finite, beams that are no range, ranges of beams that overlap, a mirror without beams.
Result<LaserRig> read_laser_rig(const std::filesystem::path& path);

/// Writes the same, whole or not at all.
Result<void> write_laser_rig(const std::filesystem::path& path, const LaserRig& rig);

}  // namespace hm
