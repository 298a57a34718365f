#include "hm/pipeline/checks/recording_findings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "hm/core/text/counted.hpp"

namespace hm {
namespace {

void add(RecordingReport& report, FindingKind kind, std::string message) {
  report.findings.push_back({kind, std::move(message)});
}

/// A reading is clearly better when its error is less than this part of the other's ...
constexpr double kClearlyBetter_ratio = 0.5;
/// ... and for at least this share of the pairs less than that part ...
constexpr double kMinVotes_ratio = 0.75;
constexpr double kVote_ratio = 0.8;
/// ... and its points meet measured depth as often as this.
constexpr double kMinOverlap_ratio = 0.3;
/// Depth and poses of any sensor in use agree better than this, relative to depth.
constexpr double kPoorAgreement_ratio = 0.02;

/// Fit of one reading of the recording, over all pairs.
struct Fit {
  ReadingHypothesis hypothesis;
  std::vector<Agreement> by_pair;
  Agreement median;
};

Fit fit_of(const std::vector<FramePair>& pairs, const PinholeCamera& camera,
           const ReadingHypothesis& hypothesis) {
  Fit fit{hypothesis, compare_all(pairs, camera, hypothesis), {}};
  fit.median = median_of(fit.by_pair);
  return fit;
}

bool clearly_better(const Fit& a, const Fit& than_b) {
  if (a.median.overlap_ratio < kMinOverlap_ratio || a.median.systematic > kPoorAgreement_ratio) return false;
  if (a.median.relative >= than_b.median.relative) return false;
  if (a.median.systematic >= kClearlyBetter_ratio * than_b.median.systematic) return false;
  std::size_t votes = 0;
  for (std::size_t i = 0; i < a.by_pair.size(); ++i)
    if (a.by_pair[i].systematic < kVote_ratio * than_b.by_pair[i].systematic) ++votes;
  return static_cast<double>(votes) >= kMinVotes_ratio * static_cast<double>(a.by_pair.size());
}

/// A large depth scale makes the camera's translation vanish beside the scene. Such a reading counts only
/// when it fits better than one in which nothing but the rotation is left.
bool beats_rotation_alone(const Fit& fit, const std::vector<FramePair>& pairs, const PinholeCamera& camera) {
  constexpr double kEndless = 1e6, kBetter_ratio = 0.7;
  if (fit.hypothesis.depth_factor <= 1) return true;
  ReadingHypothesis rotation_alone = fit.hypothesis;
  rotation_alone.depth_factor = kEndless;
  return fit.median.systematic < kBetter_ratio * fit_of(pairs, camera, rotation_alone).median.systematic;
}

/// Name of the unit that the poses seem to be in, where the reading makes depth as many times larger although
/// it is plausible as given; nullptr where the reading says nothing about the poses' unit.
const char* pose_unit(const ReadingHypothesis& hypothesis, const DepthReport& depth) {
  constexpr double kNear_m = 0.3, kFar_m = 8;
  if (depth.median_m < kNear_m || depth.median_m > kFar_m) return nullptr;
  if (hypothesis.depth_factor == 1000) return "millimetres";
  return hypothesis.depth_factor == 100 ? "centimetres" : nullptr;
}

FindingKind kind_of(const ReadingHypothesis& hypothesis, const DepthReport& depth) {
  if (hypothesis.poses_inverted) return FindingKind::kInvertedPoses;
  if (hypothesis.real_part_first) return FindingKind::kQuaternionOrder;
  if (hypothesis.fy_flipped) return FindingKind::kFlippedFy;
  return pose_unit(hypothesis, depth) ? FindingKind::kPoseUnit : FindingKind::kDepthScale;
}

/// The change in words, with the remedy.
std::string advice(const ReadingHypothesis& hypothesis, const RecordingReport& report) {
  const RecordingInfo& info = report.info;
  std::string text;
  const auto say = [&](const std::string& part) { text += (text.empty() ? "" : ", and ") + part; };
  if (hypothesis.poses_inverted) say("the poses seem to be world-to-camera instead of camera-to-world");
  if (hypothesis.real_part_first)
    say("the quaternions of the poses seem to be qw qx qy qz instead of qx qy qz qw");
  if (hypothesis.fy_flipped)
    say(fmt::format("fy seems to be {} instead of {}", -info.camera.fy, info.camera.fy));
  if (const char* unit = pose_unit(hypothesis, report.depth))
    say(
        fmt::format("the poses seem to be in {} instead of metres (as given their path is {:.1f} m long, "
                    "at a median depth of {:.2f} m): divide their positions by {}",
                    unit, report.path_length_m, report.depth.median_m, hypothesis.depth_factor));
  else if (hypothesis.depth_factor != 1.0)
    say(fmt::format("the depth scale seems to be {:.6g} units per metre instead of {:.6g}",
                    1.0 / (info.depth_unit_m * hypothesis.depth_factor), 1.0 / info.depth_unit_m));
  return text;
}

/// Difference in words; `with_metres` is false where the metres of the readings compared differ.
std::string in_numbers(const Agreement& agreement, bool with_metres = true) {
  if (agreement.systematic >= 1) return "do not overlap";
  const std::string ratio =
      fmt::format("{:.2f} % of the depth with the noise averaged out", 1e2 * agreement.systematic);
  if (!with_metres) return "differ by " + ratio;
  return fmt::format("differ by {:.1f} mm ({})", 1e3 * agreement.median_m, ratio);
}

}  // namespace

void find_misreading(const std::vector<FramePair>& pairs, RecordingReport& report) {
  const PinholeCamera camera = report.info.camera.without_distortion();
  std::vector<Fit> fits;
  for (const ReadingHypothesis& hypothesis : reading_hypotheses(1 / report.info.depth_unit_m)) {
    fits.push_back(fit_of(pairs, camera, hypothesis));
    const Agreement& fit = fits.back().median;
    report.agreement.push_back(
        {to_string(hypothesis), 1e3 * fit.median_m, fit.relative, fit.systematic, fit.overlap_ratio});
  }
  const Fit &given = fits[0], &ignored = fits[1];
  const Fit* best = &given;
  for (const Fit& fit : fits) {
    if (fit.hypothesis.changes() == 0 || !clearly_better(fit, given)) continue;
    if (!beats_rotation_alone(fit, pairs, camera)) continue;
    // They come in order of changes: one with more must be clearly better than the simpler one too.
    const bool simpler_known = best != &given && fit.hypothesis.changes() > best->hypothesis.changes();
    if (simpler_known ? clearly_better(fit, *best) : fit.median.systematic < best->median.systematic)
      best = &fit;
  }
  if (best != &given) {
    Agreement read_so = best->median;
    if (pose_unit(best->hypothesis, report.depth)) read_so.median_m /= best->hypothesis.depth_factor;
    // Millimetres that grow with the scale would speak against a reading that fits better.
    const bool with_metres = given.median.systematic >= 1 || read_so.median_m <= given.median.median_m;
    return add(report, kind_of(best->hypothesis, report.depth),
               fmt::format("{}: moved by their poses, depth images {} as given; read so, they {} ({})",
                           advice(best->hypothesis, report), in_numbers(given.median, with_metres),
                           in_numbers(read_so, with_metres),
                           counted(pairs.size(), "pair of frames", "pairs of frames")));
  }
  if (given.median.systematic > kPoorAgreement_ratio)
    add(report, FindingKind::kPoorAgreement,
        fmt::format(
            "depth and poses do not fit together: moved by their poses, depth images {}; with the poses "
            "ignored they {} ({}), and no other reading of the files explains it",
            in_numbers(given.median), in_numbers(ignored.median),
            counted(pairs.size(), "pair of frames", "pairs of frames")));
}

std::string why_no_pose_fits(const RecordingInfo& info) {
  const Time first = info.stamps.front(), last = info.stamps.back();
  const Time first_pose = info.trajectory.front().stamp, last_pose = info.trajectory.back().stamp;
  std::string why =
      fmt::format("not one of {} has a pose near its stamp: ", counted(info.frame_count, "depth image"));
  if (first_pose > last || last_pose < first)
    why += fmt::format(
        "images are {} from {:.3f} to {:.3f} s, poses ({}) stamped from {:.3f} to {:.3f} s, an offset "
        "of {:.3f} s: no common clock",
        info.has_own_stamps ? "stamped" : "numbered, their times counted", first.seconds(), last.seconds(),
        info.trajectory_source, first_pose.seconds(), last_pose.seconds(), (first_pose - first).seconds());
  else
    why += fmt::format("the poses ({}) are too far apart", info.trajectory_source);
  return why + fmt::format(" (a pose is taken between two that are at most {} s apart)",
                           RecordingOptions{}.max_pose_gap_s);
}

void find_missing(RecordingReport& report) {
  const RecordingInfo& info = report.info;
  if (info.missing_images > 0)
    add(report, FindingKind::kMissing,
        fmt::format("{} missing (first: {})", counted(info.missing_images, "image"),
                    info.first_missing_image));
  if (report.depth.frames_unreadable > 0)
    add(report, FindingKind::kMissing,
        fmt::format("{} of {} cannot be read (first: {})", with_thousands(report.depth.frames_unreadable),
                    counted(report.depth.frames_unreadable + report.depth.frames_sampled, "sampled frame"),
                    report.depth.first_error));
  if (!info.poses_unreadable.empty())
    add(report, FindingKind::kMissingPoses, "poses are not used: " + info.poses_unreadable);
  if (info.posed_count == 0 && !info.trajectory.empty())
    add(report, FindingKind::kMissingPoses, why_no_pose_fits(info));
  else if (info.posed_count > 0 && info.posed_count < info.frame_count)
    add(report, FindingKind::kMissingPoses,
        fmt::format("{} of {} without a pose", with_thousands(info.frame_count - info.posed_count),
                    counted(info.frame_count, "depth image")));
  if (info.color_count == 0)
    add(report, FindingKind::kMissingColor,
        "no colour images: `hm odometry` and `hm slam` follow the depth images alone, without places known "
        "again "
        "(loops), and maps have no colour");
  if (info.color_count > 0 && info.paired_count < info.frame_count)
    add(report, FindingKind::kMissing,
        fmt::format("{} of {} without a colour image", with_thousands(info.frame_count - info.paired_count),
                    counted(info.frame_count, "depth image")));
  for (const SkippedLines& skipped : info.skipped)
    if (skipped.reason != SkippedLines::Reason::kStampNotIncreasing)
      add(report, FindingKind::kMissing, to_string(skipped));
}

void find_odd_stamps(RecordingReport& report) {
  for (const SkippedLines& skipped : report.info.skipped)
    if (skipped.reason == SkippedLines::Reason::kStampNotIncreasing)
      add(report, FindingKind::kStamps, to_string(skipped));
  if (!report.info.has_own_stamps) return;
  constexpr double kLongGap_s = 0.5, kSlowest_hz = 0.1;
  for (const StreamReport& stream : report.streams)
    if (stream.rate_hz > 0 && stream.rate_hz < kSlowest_hz)
      add(report, FindingKind::kStamps,
          fmt::format("{}: by its stamps one comes every {:.3g} s: are they seconds?", stream.name,
                      1 / stream.rate_hz));
    else if (stream.rate_hz > 0 && stream.longest_gap_s > std::max(kLongGap_s, 5.0 / stream.rate_hz))
      add(report, FindingKind::kGap,
          fmt::format("{}: {}, the longest {:.2f} s, at {:.1f} Hz", stream.name, counted(stream.gaps, "gap"),
                      stream.longest_gap_s, stream.rate_hz));
}

void find_odd_depth(RecordingReport& report) {
  constexpr double kMinValid_ratio = 0.05, kNear_m = 0.15, kFar_m = 30.0;
  // Depth cameras for rooms begin at 0.2 to 0.5 m and end at 4 to 10 m.
  constexpr double kNearest_m = 0.18, kFarthest_m = 12.0;
  const DepthReport& depth = report.depth;
  if (depth.frames_sampled == 0) return;
  if (depth.valid_ratio < kMinValid_ratio)
    add(report, FindingKind::kDepthRange,
        fmt::format("only {:.1f} % of the depth pixels hold a reading", 100 * depth.valid_ratio));
  if (depth.median_m <= 0) return;
  const auto add_scale = [&](const std::string& what) {
    add(report, FindingKind::kOddScale,
        fmt::format("the depth scale may be wrong: {} at {:.6g} units per metre; look at the depth scale "
                    "(--depth-units-per-m)",
                    what, 1.0 / report.info.depth_unit_m));
  };
  if (depth.median_m < kNear_m || depth.median_m > kFar_m)
    add_scale(fmt::format("median depth {:.3g} m", depth.median_m));
  else if (depth.p05_m < kNearest_m || depth.p95_m > kFarthest_m)
    add_scale(fmt::format("5 % of the depth readings {} {:.3g} m, where cameras for rooms see nothing,",
                          depth.p95_m > kFarthest_m ? "beyond" : "nearer than",
                          depth.p95_m > kFarthest_m ? depth.p95_m : depth.p05_m));
}

void find_color_shift(RecordingReport& report) {
  constexpr int kMinShift_px = 6;
  constexpr double kMinGain_ratio = 1.2;
  const ColorShift& shift = report.color_shift;
  if (!shift.is_judged && report.info.paired_count > 0) {
    if (!report.info.notes.empty()) report.info.notes += '\n';
    report.info.notes +=
        "whether colour is registered to depth is not judged: depth shows edges in too little of the image";
  }
  if (shift.scale_ratio != 1)
    return add(
        report, FindingKind::kUnregisteredColor,
        fmt::format(
            "colour is not registered to depth: in the image centre, the colour image is scaled by about "
            "{:.2f} and shifted by {} px right and {} px down; with this correction, colour edges match "
            "depth edges {:.2f} times as well. hm reconstruct, odometry and slam register it by "
            "what the images show, if they show it clearly; a calibration.toml with both cameras (`hm "
            "calibrate`) does "
            "it better",
            shift.scale_ratio, shift.right_px, shift.down_px, shift.gain_ratio));
  if (std::max(std::abs(shift.right_px), std::abs(shift.down_px)) < kMinShift_px ||
      shift.gain_ratio < kMinGain_ratio)
    return;
  add(report, FindingKind::kUnregisteredColor,
      fmt::format(
          "colour seems not to be registered to depth: it is shifted by {} px right and {} px down; with "
          "this correction, colour edges match depth edges {:.2f} times as well",
          shift.right_px, shift.down_px, shift.gain_ratio));
}

}  // namespace hm
