#include "hm/pipeline/compare/trajectory_evaluation.hpp"

#include <algorithm>
#include <array>

#include "hm/core/angle.hpp"
#include "hm/io/pose/trajectory_file.hpp"
#include "hm/io/rgbd/recording.hpp"
#include "hm/pipeline/common/reading_warnings.hpp"
#include "hm/report/html_report.hpp"
#include "hm/report/path_plots.hpp"
#include "hm/report/plot.hpp"
#include "hm/report/run_report.hpp"
#include "hm/report/trajectory_plots.hpp"

namespace hm {
namespace {

enum class PosesOfRecording { kReported, kTrue };

/// A trajectory file, or the poses of a recording: those that its device reports, or the true ones.
Result<Trajectory> read_poses(const std::filesystem::path& path, PosesOfRecording which,
                              std::vector<std::string>& warnings) {
  std::error_code code;
  if (!std::filesystem::is_directory(path, code)) return read_trajectory(path);
  auto recording = open_recording(path);
  if (!recording) return forward_error(recording);
  const RecordingInfo& info = (*recording)->info();
  for (std::string& warning : reading_warnings(info))
    if (std::find(warnings.begin(), warnings.end(), warning) == warnings.end())
      warnings.push_back(std::move(warning));
  // Where they are the same, a recording has one trajectory.
  return which == PosesOfRecording::kTrue && !info.truth.empty() ? info.truth : info.trajectory;
}

void add_relative(SummaryTree& v, const std::string& name, const RelativeErrors& errors) {
  if (errors.spans.empty()) return;
  v({name + "_m", {}, "{:.4f} m"}, errors.translation_m.rmse);
  v({name + "_rad", {}, "{:.3f} deg", kDegreesPerRadian}, errors.rotation_rad.rmse);
  v.shown(name + "_spans", {}, errors.spans.size());
}

}  // namespace

Result<TrajectoryError> evaluate_trajectory_files(const std::filesystem::path& estimate,
                                                  const std::filesystem::path& truth,
                                                  const TrajectoryErrorParams& params,
                                                  std::vector<std::string>& warnings) {
  const auto estimated = read_poses(estimate, PosesOfRecording::kReported, warnings);
  if (!estimated) return forward_error(estimated);
  const auto true_poses = read_poses(truth, PosesOfRecording::kTrue, warnings);
  if (!true_poses) return forward_error(true_poses);
  return evaluate_trajectory(*true_poses, *estimated, params);
}

void visit(const TrajectoryError& error, SummaryTree& v) {
  v({"ate_rmse_m", {}, "{:.4f} m"}, error.position_m.rmse);
  v({"ate_mean_m", {}, "{:.4f} m"}, error.position_m.mean);
  v({"ate_median_m", {}, "{:.4f} m"}, error.position_m.median);
  v({"ate_max_m", {}, "{:.4f} m"}, error.position_m.max);
  v({"rotation_rmse_rad", {}, "{:.3f} deg", kDegreesPerRadian}, error.rotation_rad.rmse);
  v.shown("rotation_max_rad", {}, fmt::format("{:.3f} deg", error.rotation_rad.max * kDegreesPerRadian));
  v({"rpe_translation_rmse_m", {}, "{:.4f} m"}, error.relative.translation_m.rmse);
  v({"rpe_rotation_rmse_rad", {}, "{:.3f} deg", kDegreesPerRadian}, error.relative.rotation_rad.rmse);
  v({"pairs"}, error.pairs);
  v({"relative_pairs"}, error.relative.spans.size());
  v({"truth_path_m", {}, "{:.2f} m"}, error.truth_path_m);
  v({"alignment_scale_ratio", {}, "{:.5f}"}, error.alignment.scale);
  v({"alignment_degenerate"}, error.alignment_degenerate);
  add_relative(v, "rpe_frame", error.per_frame);
  add_relative(v, "rpe_second", error.per_second);
  add_relative(v, "rpe_metre", error.per_metre);
}

std::string to_text(const TrajectoryError& error) {
  const SummaryTree tree = describe(error);
  std::string text = tree.lines(
      {"{pairs|pair of poses|pairs of poses}, true path {truth_path_m}",
       "absolute error (ATE)    rmse {ate_rmse_m}, median {ate_median_m}, max {ate_max_m}",
       "orientation             rmse {rotation_rmse_rad}, max {rotation_max_rad}", "relative error (RPE)",
       "  over a frame            rmse {rpe_frame_m} and {rpe_frame_rad} ({rpe_frame_spans|span})",
       "  over a second           rmse {rpe_second_m} and {rpe_second_rad} ({rpe_second_spans|span})",
       "  over a metre            rmse {rpe_metre_m} and {rpe_metre_rad} ({rpe_metre_spans|span})"});
  if (error.relative.delta != 1 && !error.relative.spans.empty())
    text +=
        tree.lines({fmt::format("  over {:<18} rmse {{rpe_translation_rmse_m}} and {{rpe_rotation_rmse_rad}} "
                                "({{relative_pairs|span}})",
                                fmt::format("{:g} {}", error.relative.delta,
                                            kRpeUnitNames[static_cast<std::size_t>(error.relative.unit)]))});
  if (error.alignment.scale != 1.0) text += tree.lines({"scale of the fit        {alignment_scale_ratio}"});
  if (error.alignment_degenerate)
    text += "the true path is straight: the orientation of the fit is not determined\n";
  return text;
}

std::string trajectory_report_html(const TrajectoryError& error, const std::string& title) {
  const SummaryTree tree = describe(error);
  HtmlReport report(title);
  report.set_verdict(
      HtmlReport::Verdict::kNone,
      *tree.sentence("The path of {truth_path_m} is off by {ate_rmse_m} (rmse of {pairs|position})."));
  add_cards(report, tree,
            {{"ATE", "{ate_rmse_m}", "rmse after alignment"},
             {"RPE", "{rpe_second_m}", "rmse, a second"},
             {"RPE", "{rpe_second_rad}", "rmse, a second"}});
  const Trajectory truth = matched_truth(error), estimate = matched_estimate(error);
  report.begin_section("Path");
  const std::array<NamedTrajectory, 2> paths{{{"truth", &truth}, {"estimate", &estimate}}};
  add_path_views(report, paths, "The estimate is fitted to the truth.");
  report.begin_section("Error");
  add_error_statistics(report, error);
  add_error_path(report, error);
  add_position_histogram(report, error);
  report.begin_section("Relative errors", "Of the motion over spans of one length, not divided by it.");
  add_relative_table(report, error);
  report.begin_section("Over time");
  add_error_plots(report, error);
  report.begin_section("Pose over time", "The estimate is fitted to the truth.");
  add_pose_components(report, error);
  return report.html();
}

}  // namespace hm
