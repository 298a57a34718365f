#include "hm/pipeline/dense/alignment_summary.hpp"

#include <array>

#include "hm/pipeline/common/truth_comparison.hpp"
#include "hm/report/path_plots.hpp"
#include "hm/report/plot.hpp"

namespace hm {
namespace {

/// A frame in this share of all, or more, not aligned: something is wrong.
constexpr double kMost_ratio = 0.5;

std::optional<double> ate_m(const Trajectory& truth, const Trajectory& estimate,
                            const DenseParameters& parameters) {
  if (truth.empty()) return std::nullopt;
  const auto error = evaluate_written(truth, estimate, parameters.trajectory_error);
  if (!error) return std::nullopt;
  return error->position_m.rmse;
}

PlotSeries series_of(const ReconstructionSummary& summary, const char* name, double FrameRecord::*member) {
  PlotSeries series{name, {}, {}, SeriesStyle::kLine};
  for (const FrameRecord& record : summary.records) {
    if (!record.alignment) continue;
    series.x.push_back(static_cast<double>(record.index));
    series.y.push_back(record.*member * 1e3);
  }
  return series;
}

/// The poses as they were given, of the integrated frames.
Trajectory given_trajectory(const Trajectory& integrated, const GivenPoses& given,
                            const RecordingInfo& info) {
  Trajectory trajectory;
  std::size_t next = 0;  // both lists are in order of time
  for (const StampedPose& pose : integrated) {
    while (next < info.stamps.size() && info.stamps[next] < pose.stamp) ++next;
    std::optional<SE3> its;
    if (!given.poses.empty())
      its = pose_at(given.poses, pose.stamp, given.max_gap);
    else if (next < info.frame_poses.size())
      its = info.frame_poses[next];
    if (its) trajectory.push_back({pose.stamp, *its});
  }
  return trajectory;
}

}  // namespace

AlignmentSummary summarise_alignment(const ReconstructionState& state, const GivenPoses& given,
                                     const RecordingInfo& info, const DenseParameters& parameters) {
  AlignmentSummary summary;
  summary.accepted = state.frames_aligned;
  summary.not_accepted = state.frames_not_aligned;
  summary.given = given_trajectory(state.trajectory, given, info);
  summary.given_ate_m = ate_m(info.truth, summary.given, parameters);
  summary.aligned_ate_m = ate_m(info.truth, state.trajectory, parameters);
  return summary;
}

std::string alignment_warning(const AlignmentSummary& alignment) {
  const std::size_t all = alignment.accepted + alignment.not_accepted;
  if (all == 0 || static_cast<double>(alignment.not_accepted) < kMost_ratio * static_cast<double>(all))
    return {};
  std::string reasons;
  for (const auto& [status, count] : alignment.not_accepted_by_status)
    reasons += fmt::format("{}{} x {}", reasons.empty() ? "" : ", ", count, to_string(status));
  return fmt::format(
      "{} of {} depth images could not be aligned to the map ({}) and kept the motion of their given "
      "poses; the "
      "poses or the camera's intrinsics may be wrong, or too little is in range",
      alignment.not_accepted, all, reasons);
}

void visit(const AlignmentSummary& alignment, SummaryTree& v) {
  v({"accepted", "frames aligned"}, alignment.accepted);
  v({"not_accepted", "frames not aligned"}, alignment.not_accepted);
  v.spread({"align_ms", "aligning", "{:.2f} ms"}, alignment.ms);
  v({"ate_given_m", "trajectory error as given", "{:.1f} mm", 1e3}, alignment.given_ate_m);
  v({"ate_aligned_m", "trajectory error aligned", "{:.1f} mm", 1e3}, alignment.aligned_ate_m);
}

void add_alignment_section(HtmlReport& report, const ReconstructionSummary& summary) {
  if (!summary.alignment) return;
  const AlignmentSummary& alignment = *summary.alignment;
  report.begin_section(
      "Alignment",
      *describe(alignment).sentence(
          "{accepted|depth image} aligned to the map, {not_accepted} not; {align_ms.median} each "
          "(median).[ The trajectory is off by {ate_aligned_m} (rmse), as given by {ate_given_m}.]"));
  std::vector<NamedTrajectory> paths{{"as given", &alignment.given}, {"aligned", &summary.trajectory}};
  if (!summary.recording.truth.empty()) paths.push_back({"truth", &summary.recording.truth});
  add_path_views(report, paths, "Poses as given and aligned.");
  const std::array<PlotSeries, 2> distances{series_of(summary, "before", &FrameRecord::rms_before_m),
                                            series_of(summary, "after", &FrameRecord::rms_after_m)};
  add_frame_plot(report, distances, "distance (mm)",
                 "Distance of the depth images from the map (rms of what agrees).");
  const PlotSeries shifts = series_of(summary, "correction", &FrameRecord::shift_m);
  add_frame_plot(report, std::span(&shifts, 1), "correction (mm)",
                 "By how much each image moved its camera.");
}

}  // namespace hm
