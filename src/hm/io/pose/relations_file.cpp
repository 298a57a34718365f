#include "hm/io/pose/relations_file.hpp"

#include <algorithm>

#include "hm/geometry/se2.hpp"
#include "hm/io/bytes/skip_counter.hpp"
#include "hm/io/laser/laser_log.hpp"
#include "hm/io/laser/laser_recording.hpp"

namespace hm {
namespace {

std::optional<PoseRelation> parse(const TextLine& line) {
  const auto columns = words(line.text);
  detail::NumberReader reader(columns, 0);
  PoseRelation relation{reader.stamp(), reader.stamp(), {}};
  Vec3 xyz_m, rpy_rad;
  for (int i = 0; i < 3; ++i) xyz_m[i] = reader.number();
  for (int i = 0; i < 3; ++i) rpy_rad[i] = reader.number();
  if (!reader.ok() || reader.remaining() > 0) return std::nullopt;
  relation.T_from_to = SE3(rotation_from_roll_pitch_yaw(rpy_rad), xyz_m);
  return relation;
}

}  // namespace

Result<RelationList> read_relations(const std::filesystem::path& path) {
  const auto file = TextFile::read(path);
  if (!file) return forward_error(file);
  RelationList list;
  detail::SkipCounter skips(path);
  for (const TextLine& line : file->lines()) {
    if (const auto relation = parse(line))
      list.relations.push_back(*relation);
    else if (line.ended)
      return fail(ErrorCode::kCorrupted, file->where(line),
                  "expected `t1 t2 x y z roll pitch yaw`, found `{}`", line.text);
    else
      skips.add(SkippedLines::Reason::kCutOff, line.number);
  }
  if (list.relations.empty()) return fail(ErrorCode::kNotFound, path, "no relation in this file");
  list.skipped = skips.take();
  return list;
}

void correct_relations(std::span<PoseRelation> relations, std::span<const CorrectedStamp> corrected) {
  const auto correct = [&](Time& stamp) {
    const auto found = std::ranges::lower_bound(corrected, stamp, {}, &CorrectedStamp::written);
    if (found != corrected.end() && found->written == stamp) stamp = found->corrected;
  };
  for (PoseRelation& relation : relations) {
    correct(relation.from);
    correct(relation.to);
  }
}

}  // namespace hm
