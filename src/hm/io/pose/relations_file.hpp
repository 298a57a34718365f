#pragma once
#include <filesystem>
#include <span>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/geometry/pose_relation.hpp"
#include "hm/io/rgbd/recording.hpp"

namespace hm {

struct MendedStamp;

struct RelationList {
  std::vector<PoseRelation> relations;  ///< in the order of the file
  std::vector<SkippedLines> skipped;    ///< a last line that is cut off
};

/// Reads lines `t1 t2 x y z roll pitch yaw` (seconds, metres, radians; R = Rz(yaw) Ry(pitch) Rx(roll)).
/// Comments and blank lines are skipped. An error names file:line: a wrong number of columns, something that
/// is no finite number; or no relation at all.
Result<RelationList> read_relations(const std::filesystem::path& path);

/// Gives relations that name stamps as a recording has them written the stamps that it was mended to.
/// `mended` in order of `written`, as LaserRecording has it.
void mend_relations(std::span<PoseRelation> relations, std::span<const MendedStamp> mended);

}  // namespace hm
