#pragma once
#include <filesystem>
#include <span>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/geometry/trajectory.hpp"
#include "hm/io/bytes/skipped_lines.hpp"

namespace hm {

/// Reads the poses of a text file. The format is recognised from the contents:
///
///   TUM    `stamp tx ty tz qx qy qz qw`, seconds and metres, separated by blanks, commas or semicolons; a
///          header that names the columns may put qw first (pose_table.hpp)
///   EuRoC  comma separated, a header line that starts with `#timestamp` and stamps in nanoseconds; the
///          quaternion's real part comes first. Columns after the eighth are ignored.
///   KITTI  12 numbers, the upper three rows of the 4x4 matrix row by row
///   Replica  16 numbers, the 4x4 matrix row by row
///   Redwood  (Open3D's .log) a line of three integers, the first two the number of the frame, then four
///          lines of four numbers
///
/// The last three have no stamps: pose i, in Redwood's the one of frame i, gets i seconds.
///
/// Comments (#), blank lines and CRLF are skipped. Errors name file:line: a wrong number of columns, a number
/// that is not finite, a quaternion that is not of length 1 (within 1 %), a matrix that is not rigid, stamps
/// that do not increase, no pose at all, a Redwood block of a pair of frames or cut off. Decimal stamps are
/// read exactly, to the nanosecond.
Result<Trajectory> read_trajectory(const std::filesystem::path& path);

/// Poses of a text file, with what their stamps are.
struct TrajectoryFile {
  Trajectory poses;
  bool has_stamps = true;             ///< false: pose i got i seconds
  bool names_frames = false;          ///< true: without stamps, but each pose says of which frame it is
  std::vector<SkippedLines> skipped;  ///< lines whose stamp repeats or runs backwards
};
/// The same, leaving out as few lines as possible so that stamps increase, as for the poses in a folder of a
/// recording.
Result<TrajectoryFile> read_trajectory_file(const std::filesystem::path& path);

/// The same for the frames of a recording, whose stamps these are: poses without stamps are those of the
/// frames with their numbers, from 0 on. Further errors (kInvalidValue): KITTI or Replica with another number
/// of poses than frames, Redwood with a frame that the recording does not have.
Result<Trajectory> read_trajectory_of(const std::filesystem::path& path, std::span<const Time> stamps);

/// Writes the TUM format atomically: 9 decimals, single spaces, no comment, quaternions with qw >= 0.
Result<void> write_tum_trajectory(const std::filesystem::path& path, const Trajectory& trajectory);

/// The trajectory as read_trajectory() returns it once write_tum_trajectory() has written it: with 9
/// decimals. What is measured of it is, to the last bit, what can be measured of the file.
Trajectory as_in_tum_file(const Trajectory& trajectory);

/// Writes the KITTI format atomically (without stamps): 12 numbers with 9 decimals per line.
Result<void> write_kitti_trajectory(const std::filesystem::path& path, const Trajectory& trajectory);

}  // namespace hm
