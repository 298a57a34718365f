#pragma once
#include <filesystem>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/io/recording.hpp"

namespace hm {

/// Where a vehicle was at one moment as seen from where it was at another, known from elsewhere (verified by
/// people): the yardstick of Kuemmerle et al., "On Measuring the Accuracy of SLAM Algorithms" (2009).
struct PoseRelation {
  Time from, to;  ///< in any order
  SE3 T_from_to;
};

struct RelationList {
  std::vector<PoseRelation> relations;  ///< in the order of the file
  std::vector<SkippedLines> skipped;    ///< a last line that is cut off
};

/// Reads lines `t1 t2 x y z roll pitch yaw` (seconds, metres, radians; R = Rz(yaw) Ry(pitch) Rx(roll)).
/// Comments and blank lines are skipped. An error names file:line: a wrong number of columns, something that
/// is no finite number; or no relation at all.
Result<RelationList> read_relations(const std::filesystem::path& path);

}  // namespace hm
