#pragma once
#include <filesystem>
#include <optional>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/geometry/trajectory.hpp"
#include "hm/io/bytes/skipped_lines.hpp"
#include "hm/io/lists/stamped_list.hpp"

namespace hm::detail {

/// Poses of a tracked device, with the times at which tracking was lost.
struct PoseList {
  Trajectory poses;
  std::vector<Time> lost;  ///< stamps of lines with NaN or a rotation of zero length, increasing
  std::vector<SkippedLines> skipped;
};
/// Reads lines `stamp tx ty tz qx qy qz qw` (seconds, metres), separated and named as pose_table() allows. A
/// malformed line is an error naming file:line, except for an unterminated last line, which is skipped as cut
/// off. Lines are sorted or skipped by their stamps as in the lists of images.
Result<PoseList> read_pose_list(const std::filesystem::path& path, const StampRule& rule = {});

/// Interpolated pose at a time; nothing when its neighbours are more than `max_gap` apart or tracking was
/// lost in between.
std::optional<SE3> pose_between(const PoseList& list, Time stamp, Duration max_gap);

}  // namespace hm::detail
