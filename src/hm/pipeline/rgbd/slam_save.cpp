#include "hm/pipeline/rgbd/slam_save.hpp"

#include <algorithm>
#include <utility>

#include "hm/core/run_context.hpp"
#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/bytes/json.hpp"
#include "hm/io/pose/trajectory_file.hpp"
#include "hm/mapping/dense_pipeline.hpp"
#include "hm/pipeline/dense/dense_parameters.hpp"

namespace hm {

MapHeader slam_map_header(const RgbdParameters& parameters, const VolumeGrid& grid,
                          const SlamSaveState& state) {
  RgbdParameters of_map = parameters;
  MapHeader header;
  header.voxel_size_m = grid.voxel_size_m();
  header.sdf_unit_m = grid.sdf_unit_m();
  header.program_version = state.program_version;
  header.state_json = to_json_text(JsonValue::object({{"slam_frames", state.next_frame},
                                                      {"first_stamp_ns", state.first_stamp.ns},
                                                      {"recording_frames", state.recording_frames},
                                                      {"up", to_string(state.up)}}),
                                   JsonStyle::kCompact);
  header.parameters_toml = list_reconstruction(of_map).to_toml();
  return header;
}

SlamSaveState initial_save_state(const RecordingInfo& info, const std::string& program_version) {
  return {program_version, info.stamps.empty() ? Time{} : info.stamps.front(), info.frame_count, 0, {}};
}

Result<std::size_t> frames_of_saved_slam(const std::filesystem::path& map, const SlamSaveState& state) {
  std::error_code code;
  if (!std::filesystem::exists(map, code)) return 0;
  const auto file = MapFile::open(map, MapOpenMode::kRead);
  if (!file) return forward_error(file);
  const auto saved = parse_json(file->header().state_json, map.string());
  const auto number = [&](std::string_view key) -> std::int64_t {
    const JsonValue* value = saved ? saved->find(key) : nullptr;
    return value && value->as_integer() ? *value->as_integer() : -1;
  };
  if (number("slam_frames") < 0)
    return fail(ErrorCode::kUsage, map.string(), "this map was not made by `hm slam`");
  if (number("first_stamp_ns") != state.first_stamp.ns ||
      number("recording_frames") != static_cast<std::int64_t>(state.recording_frames))
    return fail(ErrorCode::kUsage, map.string(),
                "this map was made from another recording (of {} frames, from {:.3f} s)",
                number("recording_frames"), Time{number("first_stamp_ns")}.seconds());
  return static_cast<std::size_t>(number("slam_frames"));
}

SlamSave::SlamSave(SlamPipeline& pipeline, ResultFolder& folder, const RgbdParameters& parameters,
                   const SlamSaveState& state)
    : pipeline_(pipeline), folder_(folder), parameters_(parameters), state_(state) {}

bool SlamSave::is_due() const {
  const ReconstructionParams& params = parameters_.reconstruction;
  constexpr double kRest_ratio = 2;
  if (since_save_.seconds() < kRest_ratio * last_copy_s_) return false;
  if (params.save_interval_frames > 0 &&
      frames_since_save_ >= static_cast<std::size_t>(params.save_interval_frames))
    return true;
  return params.save_interval_s > 0 && since_save_.seconds() >= params.save_interval_s;
}

Result<void> SlamSave::after_frame(std::size_t next_frame) {
  ++frames_since_save_;
  if (!copy_) return is_due() && next_frame > state_.next_frame ? begin(next_frame) : Result<void>();
  const auto complete = as_run_failure(copy_->go_on());
  if (!complete) return forward_error(complete);
  return *complete ? publish() : Result<void>();
}

Result<void> SlamSave::begin(std::size_t next_frame) {
  trajectory_ = pipeline_.trajectory_now();
  if (trajectory_.empty()) return {};
  since_save_.restart();
  frames_since_save_ = 0;
  state_.next_frame = next_frame;
  const VolumeGrid& grid = pipeline_.dense().grid();
  auto copy = as_run_failure(MapCopy::begin(pipeline_.dense().grid(), folder_.staging() / "map.hmap",
                                            slam_map_header(parameters_, grid, state_)));
  if (!copy) return forward_error(copy);
  copy_.emplace(std::move(*copy));
  return {};
}

Result<void> SlamSave::publish() {
  copy_.reset();
  last_copy_s_ = since_save_.seconds();
  RgbdParameters parameters = parameters_;
  std::vector<std::filesystem::path> files;
  for (const char* name : {"map.hmap", "trajectory.tum", "parameters.toml"})
    files.push_back(folder_.staging() / name);
  auto written = write_tum_trajectory(files[1], trajectory_);
  if (written) written = write_file_text(files[2], list_slam(parameters).to_toml());
  if (!written) return as_run_failure(written);
  return folder_.publish(files, RunState::kRunning);
}

}  // namespace hm
