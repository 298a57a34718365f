#pragma once
#include <filesystem>

#include "hm/core/result.hpp"
#include "hm/geometry/trajectory.hpp"

namespace hm {

/// Reads the poses of a text file. The format is told from its contents:
///
///   TUM    `stamp tx ty tz qx qy qz qw`, seconds and metres, separated by blanks
///   EuRoC  comma separated, a header line that starts with `#timestamp` and stamps in nanoseconds; the
///          quaternion's real part comes first. Columns after the eighth are ignored.
///   KITTI  12 numbers, the upper three rows of the 4x4 matrix row by row; it has no stamps, so pose i gets
///          i seconds
///
/// Comments (#), blank lines and CRLF are skipped. An error names file:line: a wrong number of columns,
/// something that is no finite number, a quaternion that is not of length 1 (within 1 %), a matrix that is
/// not rigid, stamps that do not increase, no pose at all. Stamps in decimals are read exactly, to the
/// nanosecond.
Result<Trajectory> read_trajectory(const std::filesystem::path& path);

/// Writes the TUM format: 9 decimals, single spaces, no comment, quaternions with qw >= 0. The file appears
/// whole or not at all.
Result<void> write_tum_trajectory(const std::filesystem::path& path, const Trajectory& trajectory);

/// Writes the KITTI format (stamps are lost): 12 numbers with 9 decimals a line. Whole or not at all.
Result<void> write_kitti_trajectory(const std::filesystem::path& path, const Trajectory& trajectory);

}  // namespace hm
