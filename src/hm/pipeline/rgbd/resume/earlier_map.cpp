#include "hm/pipeline/rgbd/resume/earlier_map.hpp"

#include <algorithm>
#include <utility>

#include "hm/core/check.hpp"
#include "hm/io/bytes/file_bytes.hpp"

namespace hm {
namespace {

/// Between the last earlier frame and the first new one, where the clocks contradict that order.
constexpr Duration kBetweenSessions{1'000'000'000};

void shift_landmarks(std::vector<LandmarkObservation>& observations, std::uint64_t by) {
  for (LandmarkObservation& seen : observations)
    if (seen.landmark != 0) seen.landmark += by;
}

std::size_t moved_index(std::size_t index, std::int64_t by) {
  return static_cast<std::size_t>(static_cast<std::int64_t>(index) + by);
}

std::uint64_t largest_landmark(const std::vector<TrackedRecord>& records) {
  std::uint64_t largest = 0;
  for (const TrackedRecord& record : records)
    if (record.keyframe)
      for (const LandmarkObservation& seen : record.keyframe->observations)
        largest = std::max(largest, seen.landmark);
  return largest;
}

/// Rotation of its map at the end of the earlier run, beyond the poses of its tracking (slam.level): the
/// first keyframe is where the map begins.
SE3 turn_of_map(const SlamCheckpoint& checkpoint, const std::vector<TrackedRecord>& records) {
  const auto first =
      std::find_if(records.begin(), records.end(), [](const TrackedRecord& r) { return r.keyframe; });
  if (checkpoint.places.empty()) return {};
  return checkpoint.places.front().T_map_camera * first->keyframe->T_odom_camera.inverse();
}

bool same_camera(const PinholeCamera& a, const PinholeCamera& b) {
  return a.width == b.width && a.height == b.height && a.fx == b.fx && a.fy == b.fy && a.cx == b.cx &&
         a.cy == b.cy;
}

/// The recordings that the map was made of, as far as they can still be read.
void open_sessions(const PinholeCamera& camera, EarlierMap& earlier) {
  for (const MapSession& session : earlier.sessions) {
    auto opened = open_recording(session.recording, session.options());
    std::string why = opened ? std::string() : to_string(opened.error());
    if (opened &&
        ((*opened)->info().frame_count != session.frames || !same_camera((*opened)->camera(), camera)))
      why = session.recording + ": is not the recording it was";
    if (!why.empty())
      earlier.warnings.push_back(why + "; what it saw is not in the dense map (" + earlier.folder.string() +
                                 " still has it)");
    earlier.recordings.push_back(why.empty() ? std::move(*opened) : nullptr);
  }
}

Result<SavedSlam> state_of_folder(const std::filesystem::path& folder) {
  auto saved = read_slam_state(folder);
  if (!saved) {
    saved.error().message += "; this map cannot be continued";
    return forward_error(saved);
  }
  if (!*saved)
    return fail(ErrorCode::kNotFound, (folder / kSlamStateName).string(),
                "does not exist: only a result of `hm slam` with slam.align off and odometry.method=tracker "
                "can be continued");
  const auto& records = (*saved)->records;
  if (std::none_of(records.begin(), records.end(), [](const TrackedRecord& r) { return r.keyframe; }))
    return fail(ErrorCode::kNoResult, folder.string(), "the saved map has no keyframe to come back to");
  return std::move(**saved);
}

}  // namespace

std::vector<Observation> mapped_frames(std::span<const TrackedRecord> records) {
  std::vector<Observation> observations;
  for (const TrackedRecord& record : records)
    if (record.is_mapped)
      observations.push_back({record.index, record.stamp, record.submap, *record.T_odom_camera, {}});
  return observations;
}

std::shared_ptr<const Keyframe> shifted(const Keyframe& keyframe, const RecordShift& shift) {
  auto out = std::make_shared<Keyframe>(keyframe);
  out->frame_index = moved_index(keyframe.frame_index, shift.frames);
  out->stamp = keyframe.stamp + shift.time;
  out->submap = keyframe.submap + shift.submaps;
  out->T_odom_camera = shift.T_map_odom * keyframe.T_odom_camera;
  shift_landmarks(out->observations, shift.landmarks);
  if (out->before) {
    out->before->frame_index = moved_index(out->before->frame_index, shift.frames);
    shift_landmarks(out->before->observations, shift.landmarks);
  }
  return out;
}

TrackedRecord shifted(const TrackedRecord& record, const RecordShift& shift) {
  TrackedRecord out = record;
  out.index = moved_index(record.index, shift.frames);
  if (!record.was_read) return out;
  out.stamp = record.stamp + shift.time;
  out.submap = record.submap + shift.submaps;
  if (record.T_odom_camera) out.T_odom_camera = shift.T_map_odom * *record.T_odom_camera;
  if (record.keyframe) out.keyframe = shifted(*record.keyframe, shift);
  return out;
}

std::vector<std::shared_ptr<const Keyframe>> EarlierMap::keyframes() const {
  std::vector<std::shared_ptr<const Keyframe>> keyframes;
  for (const TrackedRecord& record : records)
    if (record.keyframe) keyframes.push_back(record.keyframe);
  return keyframes;
}

std::vector<Observation> EarlierMap::mapped_frames() const {
  std::vector<Observation> observations = hm::mapped_frames(records);
  std::erase_if(observations,
                [this](const Observation& o) { return !recording_of(o.frame_index).recording; });
  return observations;
}

std::size_t EarlierMap::frame_count() const {
  std::size_t count = 0;
  for (const MapSession& session : sessions) count += static_cast<std::size_t>(session.frames);
  return count;
}

Result<EarlierMap> read_earlier_map(const std::filesystem::path& folder, const Recording& recording,
                                    std::size_t first_frame) {
  auto saved = state_of_folder(folder);
  if (!saved) return forward_error(saved);
  const PinholeCamera camera = recording.camera(), &theirs = saved->checkpoint.camera;
  if (!same_camera(camera, theirs))
    return fail(ErrorCode::kUsage, folder.string(),
                "the map was made with a camera of {}x{}, f {} {}, c {} {} (now {}x{}, f {} {}, c {} {}); "
                "only recordings of one camera can share a map",
                theirs.width, theirs.height, theirs.fx, theirs.fy, theirs.cx, theirs.cy, camera.width,
                camera.height, camera.fx, camera.fy, camera.cx, camera.cy);
  EarlierMap earlier;
  earlier.folder = folder;
  earlier.sessions = saved->checkpoint.sessions;
  earlier.frames_of_new = recording.info().frame_count;
  RecordShift shift;
  shift.frames = static_cast<std::int64_t>(earlier.frames_of_new);
  shift.T_map_odom = turn_of_map(saved->checkpoint, saved->records);
  Time last = saved->checkpoint.first_stamp;
  for (const TrackedRecord& record : saved->records) {
    if (!record.was_read) continue;
    last = std::max(last, record.stamp);
    earlier.of_new.submaps = std::max(earlier.of_new.submaps, record.submap + 1);
  }
  const auto& stamps = recording.info().stamps;
  if (first_frame < stamps.size()) earlier.first_stamp_of_new = stamps[first_frame];
  if (earlier.first_stamp_of_new <= last) shift.time = earlier.first_stamp_of_new - (last + kBetweenSessions);
  earlier.of_new.landmarks = largest_landmark(saved->records);
  for (const TrackedRecord& record : saved->records) earlier.records.push_back(shifted(record, shift));
  open_sessions(camera, earlier);
  return earlier;
}

EarlierMap::FrameOfSession EarlierMap::recording_of(std::size_t index) const {
  if (index < frames_of_new) return {};
  std::size_t frame = index - frames_of_new;
  for (std::size_t i = 0; i < sessions.size(); ++i) {
    if (frame < sessions[i].frames) return {recordings[i].get(), frame};
    frame -= static_cast<std::size_t>(sessions[i].frames);
  }
  return {};
}

Result<RgbdFrame> FramesOfSessions::read_with(Result<RgbdFrame> (FrameSource::*how)(std::size_t) const,
                                              std::size_t index) const {
  if (index < earlier_.frames_of_new) return (recording_.*how)(index);
  const EarlierMap::FrameOfSession of = earlier_.recording_of(index);
  if (!of.recording)
    return fail(ErrorCode::kNotFound, earlier_.folder.string(), "the recording of frame {} cannot be read",
                of.index);
  auto frame = (of.recording->*how)(of.index);
  if (frame) frame->index = index;
  return frame;
}

Result<JoinedState> JoinedState::begin(const EarlierMap& earlier, const std::filesystem::path& folder) {
  auto journal = SlamJournal::create(folder / kSlamJournalName);
  if (!journal) return forward_error(journal);
  RecordShift back;
  back.frames = -static_cast<std::int64_t>(earlier.frames_of_new);
  for (const TrackedRecord& record : earlier.records) journal->add(shifted(record, back));
  return JoinedState(earlier, folder, std::move(*journal));
}

Result<void> JoinedState::add(const TrackedRecord& record) {
  RecordShift behind = earlier_->of_new;
  behind.frames = static_cast<std::int64_t>(earlier_->frame_count());
  journal_.add(shifted(record, behind));
  return journal_.written();
}

Result<std::vector<std::filesystem::path>> JoinedState::finish(SlamCheckpoint checkpoint) {
  HM_CHECK(checkpoint.sessions.size() == 1, "{} sessions of the new run", checkpoint.sessions.size());
  const EarlierMap& earlier = *earlier_;
  const auto frames_before = static_cast<std::int64_t>(earlier.frame_count());
  const auto of_new = static_cast<std::int64_t>(earlier.frames_of_new);
  for (const auto& step : {journal_.flush(), journal_.sync()})
    if (!step) return forward_error(step);
  checkpoint.journal = journal_.mark();
  checkpoint.sessions.insert(checkpoint.sessions.begin(), earlier.sessions.begin(), earlier.sessions.end());
  for (KeyframePlace& place : checkpoint.places)
    place.frame_index =
        moved_index(place.frame_index, place.frame_index < earlier.frames_of_new ? frames_before : -of_new);
  checkpoint.next_frame += static_cast<std::uint64_t>(frames_before);
  checkpoint.recording_frames += static_cast<std::uint64_t>(frames_before);
  const auto state = folder_ / kSlamStateName;
  if (const auto written = write_file_bytes(state, to_file_bytes(checkpoint)); !written)
    return forward_error(written);
  return std::vector{folder_ / kSlamJournalName, state};
}

}  // namespace hm
