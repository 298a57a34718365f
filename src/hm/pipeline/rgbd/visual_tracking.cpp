#include "hm/pipeline/rgbd/visual_tracking.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "hm/core/angle.hpp"
#include "hm/core/check.hpp"
#include "hm/core/text/counted.hpp"
#include "hm/geometry/state_bytes.hpp"
#include "hm/odometry/make_odometry.hpp"
#include "hm/pipeline/common/sensor_prior.hpp"

namespace hm {
namespace {

/// Deviation of a position by surfaces alone that is doubtful: what is mapped there is doubled by as much.
constexpr double kDoubtfulSigma_m = 0.1;

/// Why preintegrated readings did not predict a frame; empty: they did, or were not to.
std::string why_not(InertialUse use) {
  switch (use) {
    case InertialUse::kNone:
    case InertialUse::kUsed:
      break;
    case InertialUse::kLearning:
      return "biases, gravity and velocity are not known yet";
    case InertialUse::kInconsistent:
      return "they contradict the images (wrong axes, stamps or scale?)";
    case InertialUse::kWorse:
      return "constant velocity predicts the images better";
  }
  return {};
}

/// The frame that surfaces alone leave most uncertain; null: all have landmarks.
const VisualFrame* most_uncertain_by_depth(const VisualTrack& track) {
  const auto most = std::ranges::max_element(
      track.frames, {}, [](const VisualFrame& frame) { return frame.numbers.by_depth_sigma_m; });
  return most == track.frames.end() || most->numbers.by_depth_sigma_m == 0 ? nullptr : &*most;
}

}  // namespace

VisualTracking::VisualTracking(const OdometryParams& parameters, const PinholeCamera& camera,
                               const Start& start)
    : parameters_(start.is_from_kinect ? with_kinect_prior(parameters) : parameters),
      camera_(camera),
      odometry_(make_visual_odometry(parameters_, camera, start.T_odom_first_camera)),
      hints_(start.imu, parameters.use_imu) {
  if (start.imu && hints_.use() != ImuUse::kOff && parameters.method == OdometryMethod::kTracker)
    track_.imu_source = start.imu->source;
  track_.frames_total = start.frames_total;
}

void VisualTracking::set_first_camera(const SE3& T_odom_first_camera) {
  HM_CHECK(track_.frames_tracked == 0, "{} frames have a pose", track_.frames_tracked);
  odometry_ = make_visual_odometry(parameters_, camera_, T_odom_first_camera);
}

TrackedFrame VisualTracking::take(std::size_t index, const Result<RgbdFrame>& frame, double wait_ms,
                                  const OnPose& on_pose) {
  TrackedFrame tracked;
  last_ = {};
  last_.index = index;
  last_.was_read = frame.has_value();
  if (frame) {
    tracked = odometry_->track(*frame, hints_.next(frame->stamp), on_pose);
    last_.stamp = frame->stamp;
    last_.sigma_m = std::sqrt(std::max(0.0, tracked.covariance.topLeftCorner<3, 3>().trace()));
    last_.wait_ms = wait_ms;
  } else {
    tracked.status = TrackingStatus::kSkipped;
    tracked.reason = "unreadable: " + to_string(frame.error());
  }
  last_.status = tracked.status;
  last_.reason = tracked.reason;
  last_.submap = tracked.submap;
  last_.numbers = tracked.numbers;
  last_.T_odom_camera = tracked.T_odom_camera;
  last_.keyframe = tracked.new_keyframe;
  note(last_);
  return tracked;
}

void VisualTracking::note(const TrackedRecord& record) {
  if (!record.was_read) {
    track_.unused.push_back({record.index, record.reason});
    return;
  }
  ++track_.frames_read;
  track_.frames.push_back({record.index, record.stamp, record.status, record.submap,
                           record.keyframe != nullptr, record.sigma_m, record.wait_ms, record.numbers});
  if (record.status != TrackingStatus::kSkipped) times_ms_.push_back(record.numbers.total_ms);
  if (record.T_odom_camera) {
    ++track_.frames_tracked;
    track_.frames_by_depth += record.numbers.by_depth;
    track_.trajectory.push_back({record.stamp, *record.T_odom_camera});
    track_.submaps = std::max(track_.submaps, record.submap + 1);
    lost_ = false;
  } else if (record.status == TrackingStatus::kSkipped) {
    track_.unused.push_back({record.index, record.reason});
  } else {
    note_lost(record);
  }
  track_.turns_given += record.numbers.turn_given;
  track_.gravity_used += record.numbers.gravity == GravityUse::kUsed;
  track_.gravity_rejected += record.numbers.gravity == GravityUse::kRejected;
  track_.inertial_used += record.numbers.inertial == InertialUse::kUsed;
  track_.bridged += record.status == TrackingStatus::kBridged;
  if (record.status != TrackingStatus::kSkipped) track_.imu_unused_reason = why_not(record.numbers.inertial);
  track_.relocalised += record.status == TrackingStatus::kRelocalised;
  if (record.keyframe) track_.keyframes.push_back(record.keyframe);
  track_.readout_s = record.numbers.readout_s;
  track_.color_delay_s = record.numbers.color_delay_s;
  track_.model_points = record.numbers.model_points;
}

void VisualTracking::note_lost(const TrackedRecord& record) {
  ++track_.frames_lost;
  if (!lost_) {
    track_.lost.push_back({record.index, record.index, 0, 0, record.reason});
    lost_since_ = record.stamp;
  }
  lost_ = true;
  LostStretch& stretch = track_.lost.back();
  ++stretch.frames;
  stretch.last_frame = record.index;
  stretch.duration_s = (record.stamp - lost_since_).seconds();
}

bool VisualTracking::save(StateWriter& state) const {
  InertialHints hints = hints_;
  state(hints);
  return odometry_->save(state);
}

Result<void> VisualTracking::restore(StateReader& state, std::span<const TrackedRecord> records,
                                     const OdometryHistory& history) {
  HM_CHECK(track_.frames_read + track_.unused.size() == 0, "frames have been tracked");
  state(hints_);
  if (const auto restored = odometry_->restore(state, history); !restored) return restored;
  for (const TrackedRecord& record : records) note(record);
  return {};
}

VisualTrack VisualTracking::finish() {
  track_.track_ms = summarise(times_ms_);
  track_.memory_bytes = odometry_->memory_bytes();
  return std::move(track_);
}

std::vector<std::string> warnings_of(const VisualTrack& track) {
  std::vector<std::string> warnings;
  if (!track.unused.empty())
    warnings.push_back(fmt::format("{} of {} could not be used; the first is frame {}: {}",
                                   with_thousands(track.unused.size()), counted(track.frames_total, "frame"),
                                   track.unused.front().index, track.unused.front().reason));
  if (track.frames_by_depth > 0)
    warnings.push_back(
        fmt::format("{} of {} were tracked by depth alone, since their colour is missing, or shows nothing "
                    "or nothing that is known",
                    with_thousands(track.frames_by_depth), counted(track.frames_read, "frame")));
  if (track.bridged > 0)
    warnings.push_back(fmt::format(
        "{} of {} have a pose by inertial readings and surfaces, since the picture showed too little",
        with_thousands(track.bridged), counted(track.frames_read, "frame")));
  if (track.frames_lost > 0)
    warnings.push_back(fmt::format("{} of {} have no pose; tracking was lost {}, first at frame {}: {}",
                                   with_thousands(track.frames_lost), counted(track.frames_read, "frame"),
                                   counted(track.lost.size(), "time"), track.lost.front().first_frame,
                                   track.lost.front().reason));
  if (track.submaps > 1)
    warnings.push_back(
        fmt::format("the trajectory has {} disconnected pieces: the motion between them could not be tracked",
                    track.submaps));
  return warnings;
}

bool needs_color(const OdometryParams& parameters) { return parameters.method != OdometryMethod::kTracker; }

void judge_tracking(const VisualTrack& track, RunVerdict& verdict) {
  judge_missing_poses(track.frames_lost + track.unused.size(), track.frames_read + track.unused.size(),
                      "frames", verdict);
  const VisualFrame* const uncertain = most_uncertain_by_depth(track);
  if (uncertain && uncertain->numbers.by_depth_sigma_m > kDoubtfulSigma_m)
    verdict.add(
        MapVerdict::kDoubtful,
        fmt::format("around {:.1f} s after the start, surfaces alone show the camera's place, to +- {:.2f} m",
                    (uncertain->stamp - track.frames.front().stamp).seconds(),
                    uncertain->numbers.by_depth_sigma_m));
}

std::string why_no_pose(const VisualTrack& track, const std::vector<std::string>& warnings) {
  std::map<std::string, std::size_t> reasons;
  for (const UnusedFrame& frame : track.unused) ++reasons[frame.reason];
  for (const LostStretch& stretch : track.lost) reasons[stretch.reason] += stretch.frames;
  std::string most = "the range of frames is empty";
  std::size_t count = 0;
  for (const auto& [reason, frames] : reasons)
    if (frames > count) count = frames, most = fmt::format("{} x {}", frames, reason);
  return fmt::format(
      "not one of {} got a pose ({}); {}", counted(track.frames_total, "frame"), most,
      warnings.empty() ? "`hm info` may show why" : fmt::format("{}", fmt::join(warnings, "; ")));
}

void visit(const UnusedFrame& frame, SummaryTree& v) {
  v({"index", "frame", "{:d}"}, frame.index);
  v({"reason", "reason"}, frame.reason);
}

void visit(const LostStretch& stretch, SummaryTree& v) {
  v({"first_frame", "first frame", "{:d}"}, stretch.first_frame);
  v({"last_frame", "last frame", "{:d}"}, stretch.last_frame);
  v.shown("frames", "frames", stretch.frames);
  v({"duration_s", "time", "{:.2f} s"}, stretch.duration_s);
  v({"reason", "reason"}, stretch.reason);
}

void visit(const VisualTrack& track, SummaryTree& v) {
  v.object("frames", [&](SummaryTree& frames) {
    frames({"total"}, track.frames_total);
    frames({"read"}, track.frames_read);
    frames({"tracked"}, track.frames_tracked);
    frames({"by_depth"}, track.frames_by_depth);
    if (const VisualFrame* const most = most_uncertain_by_depth(track))
      frames({"by_depth_sigma_m", "place by surfaces alone uncertain by", "{:.3f} m"},
             most->numbers.by_depth_sigma_m);
    frames({"lost"}, track.frames_lost);
    frames({"unused"}, track.unused.size());
  });
  v.list("unused_frames", track.unused);
  v.spread({"track_ms", "tracking", "{:.1f} ms"}, track.track_ms, {"median", "mean", "p99", "max"});
  v({"path_length_m", "path", "{:.2f} m"}, path_length(track.trajectory));
  v({"keyframes", "keyframes"}, track.keyframes.size());
  v({"model_points", "points in the model"}, track.model_points);
  v({"submaps", "submaps"}, track.submaps);
  v({"relocalised", "relocalised"}, track.relocalised);
  if (track.readout_s != 0 || track.color_delay_s != 0)
    v.object("rolling_shutter", [&](SummaryTree& shutter) {
      shutter({"readout_s", "rows of a colour image are read out in", "{:.1f} ms", 1e3}, track.readout_s);
      shutter({"color_delay_s", "colour is later than depth by", "{:.1f} ms", 1e3}, track.color_delay_s);
    });
  if (!track.imu_source.empty())
    v.object("imu", [&](SummaryTree& imu) {
      imu({"source", "readings"}, track.imu_source);
      imu({"turns_given", "frames whose rotation was predicted by the gyroscope"}, track.turns_given);
      imu({"gravity_used", "frames whose roll and pitch were constrained by gravity"}, track.gravity_used);
      imu({"gravity_rejected", "frames whose gravity readings were rejected"}, track.gravity_rejected);
      imu({"inertial_used", "frames whose pose was predicted by gyroscope and accelerometer"},
          track.inertial_used);
      imu({"bridged", "frames with a pose from readings and surfaces, where images show too little"},
          track.bridged);
      if (!track.imu_unused_reason.empty())
        imu({"unused_reason", "the readings do not predict poses"}, track.imu_unused_reason);
    });
  v.list("lost_stretches", track.lost);
}

void visit_error(const TrajectoryError& error, SummaryTree& v) {
  v({"ate_rmse_m", "ATE", "{:.4f} m"}, error.position_m.rmse);
  if (!error.per_frame.spans.empty())
    v({"rpe_frame_m", "RPE a frame", "{:.4f} m"}, error.per_frame.translation_m.rmse);
  if (!error.per_second.spans.empty()) {
    v({"rpe_second_m", "RPE a second", "{:.4f} m"}, error.per_second.translation_m.rmse);
    v({"rpe_second_rad", "RPE a second", "{:.2f} deg", kDegreesPerRadian},
      error.per_second.rotation_rad.rmse);
  }
  if (!error.per_metre.spans.empty())
    v({"rpe_metre_m", "RPE a metre", "{:.4f} m"}, error.per_metre.translation_m.rmse);
  v({"truth_path_m", "true path", "{:.2f} m"}, error.truth_path_m);
}

std::string tracking_lines(const SummaryTree& summary) {
  return summary.lines(
      {"{frames.tracked} of {frames.total|frame} have a pose, {frames.lost} lost, {frames.unused} could not "
       "be "
       "used",
       "path      {path_length_m}[ (true path {truth_path_m})], {keyframes|keyframe}, "
       "{model_points|point} in the model",
       "shutter   rolling, {rolling_shutter.readout_s} from the first row to the last; colour "
       "{rolling_shutter.color_delay_s} after depth",
       "inertial  {imu.source}: gyroscope used in {imu.turns_given|frame}, gravity in {imu.gravity_used}, "
       "gravity rejected in {imu.gravity_rejected}; poses predicted in {imu.inertial_used}, bridged "
       "{imu.bridged}[; not trusted: {imu.unused_reason}]",
       "tracking  median {track_ms.median}, mean {track_ms.mean}, 99 % under {track_ms.p99} a frame"});
}

}  // namespace hm
