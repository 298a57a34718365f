#include "hm/pipeline/rgbd/visual_tracking.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include "hm/core/angle.hpp"
#include "hm/odometry/make_odometry.hpp"

namespace hm {
namespace {

bool has_answer(const TrackedFrame& tracked) { return tracked.T_odom_camera.has_value(); }

}  // namespace

VisualTracking::VisualTracking(const RgbdParameters& parameters, const PinholeCamera& camera, const Start& start)
    : odometry_(make_visual_odometry(parameters.odometry, camera, start.T_odom_first_camera)),
      hints_(start.imu, parameters.odometry.use_imu) {
  if (start.imu && parameters.odometry.use_imu != ImuUse::kOff &&
      parameters.odometry.method == OdometryMethod::kTracker)
    track_.imu_source = start.imu->source;
  track_.frames_total = start.frames_total;
}

TrackedFrame VisualTracking::take(std::size_t index, const Result<RgbdFrame>& frame, double wait_ms) {
  if (!frame) {
    track_.unused.push_back({index, "unreadable: " + to_string(frame.error())});
    TrackedFrame unread;
    unread.status = TrackingStatus::kSkipped;
    unread.reason = track_.unused.back().reason;
    return unread;
  }
  ++track_.frames_read;
  TrackedFrame tracked = odometry_->track(*frame, hints_.next(frame->stamp));
  VisualFrame note;
  note.index = index, note.stamp = frame->stamp, note.status = tracked.status, note.submap = tracked.submap;
  note.keyframe = tracked.new_keyframe != nullptr;
  note.sigma_m = std::sqrt(std::max(0.0, tracked.covariance.topLeftCorner<3, 3>().trace()));
  note.wait_ms = wait_ms;
  note.numbers = tracked.numbers;
  track_.frames.push_back(note);
  if (tracked.status != TrackingStatus::kSkipped) times_ms_.push_back(tracked.numbers.total_ms);
  if (has_answer(tracked)) {
    ++track_.frames_tracked;
    track_.trajectory.push_back({frame->stamp, *tracked.T_odom_camera});
    track_.submaps = std::max(track_.submaps, tracked.submap + 1);
    lost_ = false;
  } else if (tracked.status == TrackingStatus::kSkipped) {
    track_.unused.push_back({index, tracked.reason});
  } else {
    note_lost(*frame, tracked);
  }
  track_.turns_given += tracked.numbers.turn_given;
  track_.gravity_used += tracked.numbers.gravity == GravityUse::kUsed;
  track_.gravity_rejected += tracked.numbers.gravity == GravityUse::kRejected;
  track_.relocalised += tracked.status == TrackingStatus::kRelocalised;
  if (tracked.new_keyframe) track_.keyframes.push_back(tracked.new_keyframe);
  track_.model_points = tracked.numbers.model_points;
  return tracked;
}

void VisualTracking::note_lost(const RgbdFrame& frame, const TrackedFrame& tracked) {
  ++track_.frames_lost;
  const std::size_t index = track_.frames.back().index;
  if (!lost_) {
    track_.lost.push_back({index, index, 0, 0, tracked.reason});
    lost_since_ = frame.stamp;
  }
  lost_ = true;
  LostStretch& stretch = track_.lost.back();
  ++stretch.frames;
  stretch.last_frame = index;
  stretch.duration_s = (frame.stamp - lost_since_).seconds();
}

VisualTrack VisualTracking::finish() {
  track_.track_ms = summarise(times_ms_);
  track_.memory_bytes = odometry_->memory_bytes();
  return std::move(track_);
}

Trajectory true_trajectory(const RecordingInfo& info) {
  if (!info.truth.empty()) return info.truth;
  Trajectory poses;
  for (std::size_t i = 0; i < info.frame_poses.size() && i < info.stamps.size(); ++i)
    if (info.frame_poses[i] && (poses.empty() || info.stamps[i] > poses.back().stamp))
      poses.push_back({info.stamps[i], *info.frame_poses[i]});
  return poses;
}

std::optional<TrajectoryError> compare_with_truth(const Trajectory& estimate, const RecordingInfo& info,
                                                  const TrajectoryErrorParams& params,
                                                  std::vector<std::string>& warnings) {
  const Trajectory truth = true_trajectory(info);
  if (truth.empty() || estimate.size() < 3) return std::nullopt;
  auto error = evaluate_trajectory(truth, estimate, params);
  if (error) return std::move(*error);
  warnings.push_back("the trajectory cannot be compared with the recording's poses: " +
                     to_string(error.error()));
  return std::nullopt;
}

std::vector<std::string> warnings_of(const VisualTrack& track) {
  std::vector<std::string> warnings;
  if (!track.unused.empty())
    warnings.push_back(fmt::format("{} of {} frames could not be used; the first is {}: {}",
                                   track.unused.size(), track.frames_total, track.unused.front().index,
                                   track.unused.front().reason));
  if (track.frames_lost > 0)
    warnings.push_back(fmt::format(
        "{} of {} frames have no pose; tracking was lost {} times, first at frame {}: {}", track.frames_lost,
        track.frames_read, track.lost.size(), track.lost.front().first_frame, track.lost.front().reason));
  if (track.submaps > 1)
    warnings.push_back(fmt::format(
        "the trajectory is in {} pieces that do not know of each other: what is between them was not tracked",
        track.submaps));
  return warnings;
}

std::string why_no_pose(const VisualTrack& track) {
  std::map<std::string, std::size_t> reasons;
  for (const UnusedFrame& frame : track.unused) ++reasons[frame.reason];
  for (const LostStretch& stretch : track.lost) reasons[stretch.reason] += stretch.frames;
  std::string most = "the range of frames is empty";
  std::size_t count = 0;
  for (const auto& [reason, frames] : reasons)
    if (frames > count) count = frames, most = fmt::format("{} x {}", frames, reason);
  return fmt::format("not one of {} frames got a pose ({}); `hm info` may say why", track.frames_total, most);
}

void add_json(JsonValue& json, const VisualTrack& track) {
  json["frames"] = JsonValue::object({{"total", track.frames_total},
                                      {"read", track.frames_read},
                                      {"tracked", track.frames_tracked},
                                      {"lost", track.frames_lost},
                                      {"unused", track.unused.size()}});
  auto unused = JsonValue::array();
  for (const UnusedFrame& frame : track.unused)
    unused.push_back(JsonValue::object({{"index", frame.index}, {"reason", frame.reason}}));
  json["unused_frames"] = std::move(unused);
  json["track_ms"] = JsonValue::object({{"median", track.track_ms.median},
                                        {"mean", track.track_ms.mean},
                                        {"p99", track.track_ms.p99},
                                        {"max", track.track_ms.max}});
  json["path_length_m"] = path_length(track.trajectory);
  json["keyframes"] = track.keyframes.size();
  json["model_points"] = track.model_points;
  json["submaps"] = track.submaps;
  json["relocalised"] = track.relocalised;
  if (!track.imu_source.empty())
    json["imu"] = JsonValue::object({{"source", track.imu_source},
                                     {"turns_given", track.turns_given},
                                     {"gravity_used", track.gravity_used},
                                     {"gravity_rejected", track.gravity_rejected}});
  auto lost = JsonValue::array();
  for (const LostStretch& stretch : track.lost)
    lost.push_back(JsonValue::object({{"first_frame", stretch.first_frame},
                                      {"last_frame", stretch.last_frame},
                                      {"duration_s", stretch.duration_s},
                                      {"reason", stretch.reason}}));
  json["lost_stretches"] = std::move(lost);
}

void add_json(JsonValue& json, const std::optional<TrajectoryError>& error) {
  if (!error) return;
  json["ate_rmse_m"] = error->position_m.rmse;
  if (!error->per_frame.spans.empty()) json["rpe_frame_m"] = error->per_frame.translation_m.rmse;
  if (!error->per_second.spans.empty()) {
    json["rpe_second_m"] = error->per_second.translation_m.rmse;
    json["rpe_second_rad"] = error->per_second.rotation_rad.rmse;
  }
  if (!error->per_metre.spans.empty()) json["rpe_metre_m"] = error->per_metre.translation_m.rmse;
  json["truth_path_m"] = error->truth_path_m;
}

std::string to_text(const VisualTrack& track) {
  std::string text = fmt::format(
      "{} of {} frames have a pose, {} were lost, {} could not be used\n"
      "path      {:.2f} m, {} keyframes, {} points in the model\n",
      track.frames_tracked, track.frames_total, track.frames_lost, track.unused.size(),
      path_length(track.trajectory), track.keyframes.size(), track.model_points);
  if (!track.imu_source.empty())
    text += fmt::format("inertial  {}: {} turns by gyroscope, gravity used in {} frames, rejected in {}\n",
                        track.imu_source, track.turns_given, track.gravity_used, track.gravity_rejected);
  if (!track.track_ms.count) return text;
  return text + fmt::format("tracking  median {:.1f} ms, mean {:.1f} ms, 99 % under {:.1f} ms a frame\n",
                            track.track_ms.median, track.track_ms.mean, track.track_ms.p99);
}

std::string to_text_line(const std::optional<TrajectoryError>& error, const char* name) {
  if (!error) return {};
  std::string text = fmt::format("{:<9} ATE {:.4f} m", name, error->position_m.rmse);
  if (!error->per_frame.spans.empty())
    text += fmt::format(", RPE {:.4f} m a frame", error->per_frame.translation_m.rmse);
  if (!error->per_second.spans.empty())
    text += fmt::format(", {:.4f} m and {:.2f} deg a second", error->per_second.translation_m.rmse,
                        error->per_second.rotation_rad.rmse * kDegreesPerRadian);
  return text + "\n";
}

}  // namespace hm
