#pragma once
#include <filesystem>
#include <span>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/geometry/pose_relation.hpp"
#include "hm/io/bytes/skipped_lines.hpp"

namespace hm {

struct CorrectedStamp;

struct RelationList {
  std::vector<PoseRelation> relations;  ///< in the order of the file
  std::vector<SkippedLines> skipped;    ///< a truncated last line
};

/// Reads lines `t1 t2 x y z roll pitch yaw` (seconds, metres, radians; R = Rz(yaw) Ry(pitch) Rx(roll)).
/// Comments and blank lines are skipped. Errors name file:line: a wrong number of columns, a number that is
/// not finite; or no relation at all.
Result<RelationList> read_relations(const std::filesystem::path& path);

/// Replaces the written stamps of relations by the corrected stamps of the recording. `corrected` must be
/// sorted by `written`, as in LaserRecording.
void correct_relations(std::span<PoseRelation> relations, std::span<const CorrectedStamp> corrected);

}  // namespace hm
