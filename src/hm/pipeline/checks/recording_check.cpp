#include "hm/pipeline/checks/recording_check.hpp"

#include <algorithm>
#include <cmath>

#include "hm/geometry/box.hpp"
#include "hm/pipeline/checks/color_shift.hpp"
#include "hm/pipeline/checks/pose_agreement.hpp"
#include "hm/pipeline/checks/recording_findings.hpp"

namespace hm {
namespace {

/// Whether the poses of numbered images have stamps of another origin: none is that of an image.
bool has_own_stamps(const Trajectory& poses, const RecordingInfo& info) {
  return info.has_own_stamps || std::ranges::none_of(poses, [&](const StampedPose& pose) {
           return std::ranges::binary_search(info.stamps, pose.stamp);
         });
}

void describe_streams(RecordingReport& report) {
  const RecordingInfo& info = report.info;
  report.streams.push_back(describe_stream("depth", info.stamps, info.frame_count));
  report.streams.push_back(describe_stream("color", info.color_stamps, info.color_count));
  for (StreamReport& images : report.streams) images.has_own_stamps = info.has_own_stamps;
  const auto add_poses = [&](const char* name, const Trajectory& poses) {
    report.streams.push_back(describe_stream(name, stamps_of(poses), poses.size()));
    report.streams.back().has_own_stamps = has_own_stamps(poses, info);
  };
  add_poses("poses", info.trajectory);
  if (!info.truth.empty()) add_poses("truth", info.truth);
  if (info.imu)
    report.streams.push_back(describe_stream("imu", stamps_of(info.imu->samples), info.imu->samples.size()));
  report.path_length_m = path_length(info.trajectory);
  Box3 centres;
  for (const StampedPose& pose : info.trajectory) centres.extend(pose.T_world_base.translation());
  if (!centres.isEmpty()) report.pose_extent_m = centres.sizes();
}

/// Depth statistics, and where colour lies, from frames spread over the recording.
void sample_frames(const Recording& recording, const InspectOptions& options, const ProgressSink& progress,
                   RecordingReport& report) {
  const std::size_t count = recording.info().frame_count;
  const std::size_t samples = std::min(count, static_cast<std::size_t>(options.depth_samples));
  std::vector<double> depths_m;
  std::size_t pixels = 0, valid = 0;
  ColorShiftEstimator color_shift;
  for (std::size_t k = 0; k < samples; ++k) {
    if (progress) progress({"looking at depth", k, samples, ""});
    const auto frame = recording.read(samples > 1 ? k * (count - 1) / (samples - 1) : 0);
    if (!frame) {
      if (report.depth.frames_unreadable++ == 0) report.depth.first_error = to_string(frame.error());
      continue;
    }
    ++report.depth.frames_sampled;
    const auto units = frame->depth.units.pixels();
    pixels += units.size();
    valid += units.size() - static_cast<std::size_t>(std::ranges::count(units, 0));
    for (std::size_t i = 0; i < units.size(); i += 7)
      if (units[i] > 0) depths_m.push_back(units[i] * frame->depth.unit_m);
    color_shift.add(*frame);
  }
  report.color_shift = color_shift.best();
  if (depths_m.empty()) return;
  std::ranges::sort(depths_m);
  const auto at = [&](double q) {
    return depths_m[static_cast<std::size_t>(q * static_cast<double>(depths_m.size() - 1))];
  };
  DepthReport& depth = report.depth;
  depth.valid_ratio = static_cast<double>(valid) / static_cast<double>(pixels);
  depth.min_m = depths_m.front(), depth.p05_m = at(0.05), depth.median_m = at(0.5), depth.p95_m = at(0.95);
  depth.max_m = depths_m.back();
}

/// Motion that a pair of frames must have, required and preferred.
struct MotionScore {
  bool enough = false;
  bool too_far = false;
  double score = 0;
};

MotionScore score_motion(const SE3& a, const SE3& b, const InspectOptions& options) {
  constexpr double kGoodMotion_m = 0.15, kGoodRotation_rad = 0.25, kMaxRotation_rad = 0.5;
  const double translation_m = (a.translation() - b.translation()).norm();
  const double rotation_rad = (a.inverse() * b).angle();
  return {translation_m >= options.min_motion_m || rotation_rad >= options.min_rotation_rad,
          rotation_rad > kMaxRotation_rad, translation_m / kGoodMotion_m + rotation_rad / kGoodRotation_rad};
}

/// The first later frame that moved well for a comparison or, within two seconds, the one that moved most;
/// nothing when none moved enough.
std::optional<std::size_t> partner_of(const RecordingInfo& info, std::size_t i,
                                      const InspectOptions& options) {
  constexpr Duration kWindow{2'000'000'000};
  std::optional<std::size_t> best;
  double most = 0;
  for (std::size_t j = i + 1; j < info.frame_count && info.stamps[j] - info.stamps[i] <= kWindow; ++j) {
    if (!info.frame_poses[j]) continue;
    const MotionScore moved = score_motion(*info.frame_poses[i], *info.frame_poses[j], options);
    if (moved.too_far) break;
    if (moved.enough && moved.score > most) {
      best = j;
      most = moved.score;
    }
    if (most >= 1) break;
  }
  return best;
}

/// Pairs of frames spread over the recording.
std::vector<FramePair> read_pairs(const Recording& recording, const InspectOptions& options,
                                  const ProgressSink& progress) {
  const RecordingInfo& info = recording.info();
  const auto wanted = static_cast<std::size_t>(options.pairs);
  std::vector<FramePair> pairs;
  for (std::size_t k = 0; k < wanted; ++k) {
    if (progress) progress({"comparing frames", k, wanted, ""});
    const std::size_t i = k * info.frame_count / wanted;
    if (!info.frame_poses[i]) continue;
    const auto j = partner_of(info, i, options);
    if (!j) continue;
    auto from = recording.read(i), to = recording.read(*j);
    if (from && to) pairs.push_back({std::move(*from), std::move(*to)});
  }
  return pairs;
}

}  // namespace

RecordingReport inspect_recording(const Recording& recording, const InspectOptions& options,
                                  const ProgressSink& progress) {
  HM_CHECK(options.depth_samples >= 1 && options.pairs >= 1);
  RecordingReport report;
  report.info = recording.info();
  describe_streams(report);
  sample_frames(recording, options, progress, report);
  find_missing(report);
  find_odd_stamps(report);
  find_odd_depth(report);
  find_color_shift(report);
  const std::vector<FramePair> pairs = read_pairs(recording, options, progress);
  report.pairs_compared = pairs.size();
  if (!pairs.empty()) find_misreading(pairs, report);
  return report;
}

}  // namespace hm
