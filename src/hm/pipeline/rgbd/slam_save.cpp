#include "hm/pipeline/rgbd/slam_save.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <utility>

#include "hm/core/run_context.hpp"
#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/bytes/json.hpp"
#include "hm/io/pose/trajectory_file.hpp"
#include "hm/mapping/dense_pipeline.hpp"
#include "hm/pipeline/dense/dense_parameter_list.hpp"

namespace hm {
namespace {

/// Parameters that saved data depends on: all of odometry, and these.
constexpr std::array<std::string_view, 6> kOfTracking{"reconstruction.begin_frame",
                                                      "reconstruction.frame_stride",
                                                      "slam.start_at_pose",
                                                      "slam.level",
                                                      "slam.map_stride",
                                                      "slam.align"};

std::vector<std::string> tracking_parameters(const RgbdParameters& parameters) {
  RgbdParameters copy = parameters;
  const ParamList list = list_slam(copy);
  std::vector<std::string> lines;
  for (const ParamRef& param : list.all())
    if (param.name.starts_with("odometry") ||
        std::find(kOfTracking.begin(), kOfTracking.end(), param.name) != kOfTracking.end())
      lines.push_back(fmt::format("{} = {}", param.name, value_text(param)));
  return lines;
}

std::string text_of(const PinholeCamera& camera) {
  return fmt::format("{}x{}, f {} {}, c {} {}", camera.width, camera.height, camera.fx, camera.fy, camera.cx,
                     camera.cy);
}

Result<void> check_parameters_of(const SlamCheckpoint& checkpoint, const RgbdParameters& parameters,
                                 const std::string& where) {
  RgbdParameters saved;
  auto list = list_slam(saved);
  const auto read = list.read_toml(checkpoint.parameters_toml, where + " (its parameters)");
  if (!read) return tl::make_unexpected(cannot_continue(read.error()));
  const auto theirs = tracking_parameters(saved), ours = tracking_parameters(parameters);
  std::vector<std::string> differences;
  for (std::size_t i = 0; i < ours.size(); ++i)
    if (ours[i] != theirs[i])
      differences.push_back(fmt::format("{} (now {})", theirs[i], ours[i].substr(ours[i].find('=') + 2)));
  if (differences.empty()) return {};
  return fail(ErrorCode::kUsage, where, "the run was made with {}; give the same parameters, or {}",
              fmt::join(differences, ", "), kStartAnew);
}

}  // namespace

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

SlamSaveState initial_save_state(const RecordingInfo& info, const std::string& program_version,
                                 const RecordingOptions& options) {
  return {program_version,
          info.stamps.empty() ? Time{} : info.stamps.front(),
          info.frame_count,
          0,
          {},
          MapSession::of(info.path, options, info.frame_count)};
}

void SlamSaveState::describe(SlamCheckpoint& checkpoint) const {
  checkpoint.program_version = program_version;
  checkpoint.first_stamp = first_stamp;
  checkpoint.recording_frames = recording_frames;
  checkpoint.sessions = {session};
}

Result<std::size_t> frames_of_saved_slam(const std::filesystem::path& map, const SlamSaveState& state) {
  std::error_code code;
  if (!std::filesystem::exists(map, code)) return 0;
  const auto file = MapFile::open(map, MapOpenMode::kRead);
  if (!file) return forward_error(file);
  const auto saved = parse_json(file->header().state_json, map.string());
  const auto number = [&](std::string_view key) { return saved ? saved->integer_at(key, -1) : -1; };
  if (number("slam_frames") < 0)
    return fail(ErrorCode::kUsage, map.string(), "this map was not made by `hm slam`");
  if (number("first_stamp_ns") != state.first_stamp.ns ||
      number("recording_frames") != static_cast<std::int64_t>(state.recording_frames))
    return fail(ErrorCode::kUsage, map.string(),
                "this map was made from another recording (of {} frames, from {:.3f} s)",
                number("recording_frames"), Time{number("first_stamp_ns")}.seconds());
  return static_cast<std::size_t>(number("slam_frames"));
}

Result<void> check_continues(const SavedSlam& saved, const RecordingInfo& info, const PinholeCamera& camera,
                             const RgbdParameters& parameters, const std::filesystem::path& folder) {
  const SlamCheckpoint& checkpoint = saved.checkpoint;
  const std::string where = (folder / kSlamStateName).string();
  const auto is_of_recording = [&](const TrackedRecord& record) {
    return record.index < info.stamps.size() &&
           (!record.was_read || record.stamp == info.stamps[record.index]);
  };
  if (checkpoint.sessions.size() > 1)
    return fail(ErrorCode::kUsage, where, "the run went on in a saved map, and cannot be resumed; {}",
                kStartAnew);
  if (info.stamps.empty() || info.stamps.front() != checkpoint.first_stamp ||
      info.frame_count != checkpoint.recording_frames ||
      checkpoint.next_frame >
          info.frame_count + static_cast<std::size_t>(parameters.reconstruction.frame_stride) ||
      !std::all_of(saved.records.begin(), saved.records.end(), is_of_recording))
    return fail(ErrorCode::kUsage, where,
                "the run was on another recording (of {} frames, from {:.3f} s); give that one, or {}",
                checkpoint.recording_frames, checkpoint.first_stamp.seconds(), kStartAnew);
  if (text_of(camera) != text_of(checkpoint.camera))
    return fail(ErrorCode::kUsage, where, "the run was made with a camera of {} (now {}); {}",
                text_of(checkpoint.camera), text_of(camera), kStartAnew);
  if (!saved.records.empty() && saved.records.back().index >= checkpoint.next_frame)
    return fail(ErrorCode::kCorrupted, where, "is damaged: frame {} comes after it; {}",
                saved.records.back().index, kStartAnew);
  return check_parameters_of(checkpoint, parameters, where);
}

SlamSave::SlamSave(SlamPipeline& pipeline, ResultFolder& folder, const RgbdParameters& parameters,
                   const SlamSaveState& state)
    : pipeline_(pipeline), folder_(folder), parameters_(parameters), state_(state) {}

SlamSave::~SlamSave() {
  if (written_) written_->wait();
}

Result<void> SlamSave::begin_journal(const SavedSlam* resumed) {
  if (!pipeline_.can_be_saved()) return {};
  auto journal =
      resumed ? SlamJournal::continue_at(folder_.path() / kSlamJournalName, resumed->checkpoint.journal)
              : SlamJournal::create(staged(kSlamJournalName));
  if (!journal) return as_run_failure(Result<void>(forward_error(journal)));
  journal_.emplace(std::move(*journal));
  if (resumed) saved_frames_ = resumed->checkpoint.next_frame;
  is_published_ = resumed != nullptr;
  return {};
}

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
  if (journal_) journal_->add(pipeline_.last_frame());
  if (!written_) return is_due() ? begin(next_frame) : Result<void>();
  const auto written = as_run_failure(is_written());
  if (!written) return forward_error(written);
  return *written ? publish() : Result<void>();
}

/// A map only where it is further than what is saved, and whole; the state only where it is further.
Result<void> SlamSave::begin(std::size_t next_frame) {
  trajectory_ = pipeline_.trajectory_now();
  has_map_ = !trajectory_.empty() && next_frame > state_.next_frame && pipeline_.map_is_complete();
  const bool has_state = journal_ && next_frame > saved_frames_;
  if (trajectory_.empty() || (!has_map_ && !has_state)) return {};
  since_save_.restart();
  frames_since_save_ = 0;
  if (has_map_) {
    state_.next_frame = next_frame;
    const VolumeGrid& grid = pipeline_.dense().grid();
    auto copy = as_run_failure(MapCopy::begin(pipeline_.dense().grid(), staged("map.hmap"),
                                              slam_map_header(parameters_, grid, state_)));
    if (!copy) return forward_error(copy);
    copy_.emplace(std::move(*copy));
  }
  return as_run_failure(begin_state(next_frame));
}

/// Takes the state as it is now, and has it written by a thread.
Result<void> SlamSave::begin_state(std::size_t next_frame) {
  saved_frames_ = next_frame;
  if (journal_) {
    checkpoint_ = pipeline_.checkpoint(next_frame);
    state_.describe(checkpoint_);
    checkpoint_.journal = journal_->mark();
    if (const auto flushed = journal_->flush(); !flushed) return flushed;
  }
  written_ = std::async(std::launch::async, [this] { return write_state(); });
  return {};
}

/// The journal first: a state never names what is not on disk.
Result<void> SlamSave::write_state() const {
  if (!journal_) return {};
  if (const auto synced = journal_->sync(); !synced) return synced;
  return write_file_bytes(staged(kSlamStateName), to_file_bytes(checkpoint_));
}

/// Goes on with the save that is under way, for about a millisecond.
Result<bool> SlamSave::is_written() {
  if (copy_) {
    const auto complete = copy_->go_on();
    if (!complete) return forward_error(complete);
    if (*complete) copy_.reset();
  }
  if (copy_ || written_->wait_for(std::chrono::seconds(0)) != std::future_status::ready) return false;
  const auto written = std::exchange(written_, std::nullopt)->get();
  if (!written) return forward_error(written);
  return true;
}

/// The state's files before the others: it is whole without them, and renaming it is one step.
Result<void> SlamSave::publish() {
  last_copy_s_ = since_save_.seconds();
  RgbdParameters parameters = parameters_;
  std::vector<std::filesystem::path> files;
  if (journal_) files = {staged(kSlamJournalName), staged(kSlamStateName)};
  Result<void> written;
  if (has_map_) {
    files.insert(files.end(), {staged("map.hmap"), staged("trajectory.tum")});
    written = write_tum_trajectory(files.back(), trajectory_);
  }
  files.push_back(staged("parameters.toml"));
  if (written) written = write_file_text(files.back(), list_slam(parameters).to_toml());
  if (!written) return as_run_failure(written);
  is_published_ = true;
  return folder_.publish(files, RunState::kRunning);
}

Result<void> SlamSave::end_of_tracking(std::size_t next_frame) {
  copy_.reset();
  if (written_) written_->wait();
  written_.reset();
  if (!journal_) return {};
  if (const auto begun = begin_state(next_frame); !begun) return as_run_failure(begun);
  const auto written = std::exchange(written_, std::nullopt)->get();
  if (!written || !is_published_) return as_run_failure(written);
  // A kill during what follows then costs nothing of tracking. A first result comes as a whole instead.
  std::vector<std::filesystem::path> files{staged(kSlamJournalName), staged(kSlamStateName)};
  return folder_.publish(files, RunState::kRunning);
}

Result<std::vector<std::filesystem::path>> SlamSave::finish(const CorrectedKeyframes& keyframes) {
  if (!journal_) return std::vector<std::filesystem::path>();
  checkpoint_.places = keyframe_places(keyframes);
  if (const auto written = as_run_failure(write_state()); !written) return forward_error(written);
  return std::vector{staged(kSlamJournalName), staged(kSlamStateName)};
}

}  // namespace hm
