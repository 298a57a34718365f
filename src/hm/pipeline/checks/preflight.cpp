#include "hm/pipeline/checks/preflight.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "hm/core/text/add_once.hpp"
#include "hm/pipeline/checks/color_registration_fit.hpp"
#include "hm/pipeline/checks/laser_check.hpp"
#include "hm/pipeline/checks/recording_check.hpp"
#include "hm/pipeline/common/reading_warnings.hpp"

namespace hm {
namespace {

/// A recording whose frames have other poses than its files give them.
class PosedRecording final : public Recording {
 public:
  PosedRecording(const Recording& recording, const Trajectory& poses, Duration max_gap)
      : recording_(recording), info_(recording.info()) {
    for (std::size_t i = 0; i < info_.frame_count; ++i)
      info_.frame_poses[i] = pose_at(poses, info_.stamps[i], max_gap);
    info_.posed_count = static_cast<std::size_t>(std::ranges::count_if(
        info_.frame_poses, [](const std::optional<SE3>& pose) { return pose.has_value(); }));
    info_.trajectory = poses;
    info_.trajectory_source = "given";
  }
  [[nodiscard]] const RecordingInfo& info() const override { return info_; }
  [[nodiscard]] Result<RgbdFrame> read(std::size_t index) const override {
    return with_pose(recording_.read(index), index);
  }
  [[nodiscard]] Result<RgbdFrame> read_depth(std::size_t index) const override {
    return with_pose(recording_.read_depth(index), index);
  }

 private:
  [[nodiscard]] Result<RgbdFrame> with_pose(Result<RgbdFrame> frame, std::size_t index) const {
    if (frame) frame->T_world_camera = info_.frame_poses[index];
    return frame;
  }

  const Recording& recording_;
  RecordingInfo info_;
};

RecordingReport quick_report(const Recording& recording, const PreflightOptions& options) {
  constexpr InspectOptions kQuick{.depth_samples = 8, .pairs = 6};
  if (!options.given) return inspect_recording(recording, kQuick);
  return inspect_recording(
      PosedRecording(recording, *options.given, Duration::from_seconds(options.max_pose_gap_s)), kQuick);
}

/// Whether nothing sensible can come out of a recording with this finding.
bool is_fatal(const Finding& finding, const RecordingReport& report, const PreflightOptions& options) {
  constexpr std::size_t kMinPairs = 4;  // that agree on another reading of the files
  constexpr double kEmpty_ratio = 0.002;
  switch (finding.kind) {
    case FindingKind::kDepthScale:
    case FindingKind::kFlippedFy:
      return report.pairs_compared >= kMinPairs;
    case FindingKind::kInvertedPoses:
    case FindingKind::kQuaternionOrder:
    case FindingKind::kPoseUnit:
      return options.poses == PoseUse::kBuildsOn && report.pairs_compared >= kMinPairs;
    case FindingKind::kMissingPoses:
      return options.poses == PoseUse::kBuildsOn && report.info.posed_count == 0;
    case FindingKind::kMissingColor:
      return options.needs_color;
    case FindingKind::kDepthRange:
      return report.depth.valid_ratio < kEmpty_ratio;
    default:
      return false;
  }
}

/// Whether the result is doubtful with this finding: it has another size or shape than the scene.
bool casts_doubt(FindingKind kind, PoseUse poses) {
  switch (kind) {
    case FindingKind::kDepthScale:
    case FindingKind::kOddScale:
    case FindingKind::kFlippedFy:
      return true;
    case FindingKind::kInvertedPoses:
    case FindingKind::kQuaternionOrder:
    case FindingKind::kPoseUnit:
      return poses == PoseUse::kBuildsOn;
    default:
      return false;
  }
}

/// A run that builds on given poses needs no colour; one that finds its own needs no poses.
bool concerns_run(const Finding& finding, PoseUse poses) {
  if (poses == PoseUse::kBuildsOn) return finding.kind != FindingKind::kMissingColor;
  return finding.kind != FindingKind::kMissingPoses && finding.kind != FindingKind::kPoorAgreement;
}

/// Whether it is found in the images, not in stamps, files or poses.
bool is_about_images(FindingKind kind) {
  return kind == FindingKind::kUnregisteredColor || kind == FindingKind::kOddScale ||
         kind == FindingKind::kDepthRange;
}

/// Registers the recording's colour if its images show how; then says what was done.
std::optional<std::string> register_color_of(std::unique_ptr<Recording>& recording) {
  const std::optional<FittedRegistration> fitted = fit_color_registration(*recording);
  if (!fitted) return std::nullopt;
  recording = with_registered_color(std::move(recording), fitted->registration);
  return to_string(*fitted, recording->camera());
}

/// Notes a finding in these words, and as a doubt if it is one.
void note(const Finding& finding, const std::string& words, PoseUse poses, Preflight& said) {
  add_once(said.warnings, words);
  if (casts_doubt(finding.kind, poses)) add_once(said.doubts, finding.message);
}

tl::unexpected<Error> refused(const std::filesystem::path& recording, const std::string& finding) {
  return fail(ErrorCode::kInvalidValue, recording.string(),
              "{}{} Nothing was made of it; `hm info` shows more, --force runs all the same", finding,
              finding.ends_with('?') ? "" : ".");
}

}  // namespace

Preflight check_images(const Recording& recording) {
  Preflight said;
  for (const Finding& finding : quick_report(recording, {}).findings)
    if (is_about_images(finding.kind)) note(finding, finding.message, PoseUse::kComparesWith, said);
  return said;
}

Result<Preflight> check_before_run(std::unique_ptr<Recording>& recording, const PreflightOptions& options) {
  const RecordingReport report = quick_report(*recording, options);
  Preflight said{reading_warnings(recording->info()), {}};
  for (const Finding& finding : report.findings) {
    if (is_fatal(finding, report, options) && !options.force)
      return refused(recording->info().path, finding.message);
    if (!concerns_run(finding, options.poses)) continue;
    const bool wants_color = finding.kind == FindingKind::kUnregisteredColor && options.register_color;
    const std::optional<std::string> registered = wants_color ? register_color_of(recording) : std::nullopt;
    note(finding, registered.value_or(finding.message), options.poses, said);
  }
  return said;
}

Result<std::vector<std::string>> check_before_laser_run(const LaserRecording& recording, bool force) {
  std::vector<std::string> warnings = reading_warnings(recording);
  for (const LaserFinding& finding : inspect_laser_recording(recording).findings) {
    if (finding.kind == LaserFindingKind::kRangeUnits && !force)
      return refused(recording.path, finding.message);
    add_once(warnings, finding.message);
  }
  return warnings;
}

}  // namespace hm
