#include <algorithm>

#include "hm/io/bytes/json.hpp"
#include "hm/pipeline/dense/reconstruction_state.hpp"

namespace hm {
namespace {

constexpr int kStateVersion = 1;

/// A pose exactly: nanoseconds, then rotation and translation row by row.
JsonValue pose_to_json(const StampedPose& pose) {
  auto numbers = JsonValue::array();
  numbers.push_back(pose.stamp.ns);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) numbers.push_back(pose.T_world_base.rotation()(row, column));
    numbers.push_back(pose.T_world_base.translation()[row]);
  }
  return numbers;
}

bool pose_from_json(const JsonValue& json, StampedPose& pose) {
  const auto* numbers = json.as_array();
  if (!numbers || numbers->size() != 13 || !numbers->front().as_integer()) return false;
  Mat3 rotation;
  Vec3 translation;
  for (std::size_t row = 0; row < 3; ++row) {
    const auto r = static_cast<Eigen::Index>(row);
    for (std::size_t column = 0; column < 3; ++column)
      rotation(r, static_cast<Eigen::Index>(column)) = (*numbers)[1 + row * 4 + column].number_or(0);
    translation[r] = (*numbers)[4 + row * 4].number_or(0);
  }
  pose = {{*numbers->front().as_integer()}, SE3(rotation, translation)};
  return is_rigid(pose.T_world_base);
}

/// Keys as x, y, z, x, y, z ...; what is no number becomes 0 and marks nothing.
std::vector<VolumeKey> keys_from_json(const JsonValue::Array& numbers) {
  std::vector<VolumeKey> keys;
  const auto at = [&](std::size_t i) {
    const std::int64_t* whole = numbers[i].as_integer();
    return static_cast<std::int32_t>(whole ? std::clamp<std::int64_t>(*whole, -(1 << 30), 1 << 30) : 0);
  };
  for (std::size_t i = 0; i + 2 < numbers.size(); i += 3) keys.push_back({at(i), at(i + 1), at(i + 2)});
  return keys;
}

std::size_t count_of(const JsonValue& json, std::string_view key) {
  return static_cast<std::size_t>(std::max<std::int64_t>(0, json.integer_at(key, 0)));
}

}  // namespace

std::string state_to_json(const ReconstructionState& state) {
  auto skipped = JsonValue::array(), trajectory = JsonValue::array();
  for (const SkippedFrame& frame : state.skipped)
    skipped.push_back(JsonValue::object({{"index", frame.index}, {"reason", frame.reason}}));
  for (const StampedPose& pose : state.trajectory) trajectory.push_back(pose_to_json(pose));
  auto marks = JsonValue::array();
  for (const VolumeKey& key : state.interior_marks)
    for (const int index : {key.x, key.y, key.z}) marks.push_back(index);
  return to_json_text(JsonValue::object({{"state_version", kStateVersion},
                                         {"recording", state.recording},
                                         {"kind", static_cast<int>(state.kind)},
                                         {"first_stamp_ns", state.first_stamp.ns},
                                         {"next_frame", state.next_frame},
                                         {"frames_read", state.frames_read},
                                         {"frames_integrated", state.frames_integrated},
                                         {"volumes_refused", state.volumes_refused},
                                         {"frames_aligned", state.frames_aligned},
                                         {"frames_not_aligned", state.frames_not_aligned},
                                         {"T_map_given", pose_to_json({{}, state.T_map_input})},
                                         {"T_level_given", pose_to_json({{}, state.T_level_given})},
                                         {"up", to_string(state.up)},
                                         {"skipped", std::move(skipped)},
                                         {"trajectory", std::move(trajectory)},
                                         {"interior_marks", std::move(marks)}}),
                      JsonStyle::kCompact);
}

Result<ReconstructionState> state_from_json(std::string_view text, const std::string& where) {
  const auto json =
      text.empty() ? Result<JsonValue>(JsonValue::object()) : parse_json(text, where + " (its state)");
  if (!json) return forward_error(json);
  if (json->find("state_version") == nullptr)
    return fail(
        ErrorCode::kUsage, where,
        "this map was not made by `hm reconstruct`, which could continue it: choose another folder, or "
        "start anew without --resume");
  if (count_of(*json, "state_version") != kStateVersion)
    return fail(ErrorCode::kUnsupported, where,
                "it does not hold a reconstruction that this program can continue");
  ReconstructionState state;
  state.recording = json->text_at("recording");
  const std::size_t kind = count_of(*json, "kind");
  if (kind > static_cast<std::size_t>(RecordingKind::kIclNuim))
    return fail(ErrorCode::kCorrupted, where, "the kind of recording {} of its state is damaged", kind);
  state.kind = static_cast<RecordingKind>(kind);
  state.first_stamp = {json->integer_at("first_stamp_ns", 0)};
  state.next_frame = count_of(*json, "next_frame");
  state.frames_read = count_of(*json, "frames_read");
  state.frames_integrated = count_of(*json, "frames_integrated");
  state.volumes_refused = count_of(*json, "volumes_refused");
  state.frames_aligned = count_of(*json, "frames_aligned");
  state.frames_not_aligned = count_of(*json, "frames_not_aligned");
  for (const auto& [key, motion] :
       {std::pair{"T_map_given", &state.T_map_input}, std::pair{"T_level_given", &state.T_level_given}})
    if (const JsonValue* stored = json->find(key)) {
      StampedPose pose;
      if (!pose_from_json(*stored, pose))
        return fail(ErrorCode::kCorrupted, where, "{} of its state is damaged", key);
      *motion = pose.T_world_base;
    }
  for (const JsonValue& frame : json->list_at("skipped"))
    state.skipped.push_back({count_of(frame, "index"), frame.text_at("reason")});
  state.up = parse_up(json->text_at("up")).value_or(UpDirection());
  state.interior_marks = keys_from_json(json->list_at("interior_marks"));
  for (const JsonValue& pose : json->list_at("trajectory"))
    if (!pose_from_json(pose, state.trajectory.emplace_back()))
      return fail(ErrorCode::kCorrupted, where, "pose {} of its state is damaged",
                  state.trajectory.size() - 1);
  return state;
}

}  // namespace hm
