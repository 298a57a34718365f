#pragma once
#include <filesystem>

#include "hm/core/result.hpp"
#include "hm/sensors/laser_rig.hpp"

namespace hm {

/// Reads the mounting of a laser and the beams deflected by mirrors (TOML):
///
///     [laser]                      # pose in the base frame (x forward, y left, z up)
///     xyz_m = [0.0, 0.0, 0.12]
///     rpy_deg = [0.0, 0.0, 0.0]    # R = Rz(yaw) Ry(pitch) Rx(roll)
///     [imu]                        # the same; optional
///     [horizontal]                 # optional: beams in the scan plane, neither deflected nor occluded
///     beams = [56, 1024]           # half-open range: first, last + 1
///     [range]                      # optional: a range sensor, which looks along its own x axis
///     xyz_m = [0.0, 0.0, -0.05]    # pose in the base frame
///     rpy_deg = [0.0, 90.0, 0.0]   # down
///     [down]                       # optional mirrors: [down], [up]
///     beams = [0, 20]
///     xyz_m = [0.1, 0.0, 0.05]     # pose of the virtual laser behind the mirror, in the laser frame
///     rpy_deg = [0.0, 90.0, 0.0]
///
/// A missing pose is identity. Errors name file and line: invalid TOML, an unknown key or table, a wrong
/// type, numbers that are not finite, an invalid beam range, overlapping beam ranges, a mirror without beams.
Result<LaserRig> read_laser_rig(const std::filesystem::path& path);

/// Writes the same format, atomically.
Result<void> write_laser_rig(const std::filesystem::path& path, const LaserRig& rig);

}  // namespace hm
