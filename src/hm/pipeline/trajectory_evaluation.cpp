#include "hm/pipeline/trajectory_evaluation.hpp"

#include <array>
#include <numbers>

#include "hm/evaluation/html_report.hpp"
#include "hm/evaluation/plot.hpp"
#include "hm/io/recording.hpp"
#include "hm/io/trajectory_file.hpp"

namespace hm {
namespace {

enum class PosesOfRecording { kReported, kTrue };

/// A trajectory file, or the poses of a recording: those that its device reports, or the true ones.
Result<Trajectory> read_poses(const std::filesystem::path& path, PosesOfRecording which) {
  std::error_code code;
  if (!std::filesystem::is_directory(path, code)) return read_trajectory(path);
  auto recording = open_recording(path);
  if (!recording) return forward_error(recording);
  const RecordingInfo& info = (*recording)->info();
  // Where they are the same, a recording has one trajectory.
  return which == PosesOfRecording::kTrue && !info.truth.empty() ? info.truth : info.trajectory;
}

constexpr double kDegrees = 180 / std::numbers::pi;  ///< in a radian

}  // namespace

Result<TrajectoryError> evaluate_trajectory_files(const std::filesystem::path& estimate,
                                                  const std::filesystem::path& truth,
                                                  const TrajectoryErrorParams& params) {
  const auto estimated = read_poses(estimate, PosesOfRecording::kReported);
  if (!estimated) return forward_error(estimated);
  const auto true_poses = read_poses(truth, PosesOfRecording::kTrue);
  if (!true_poses) return forward_error(true_poses);
  return evaluate_trajectory(*true_poses, *estimated, params);
}

JsonValue to_json(const TrajectoryError& error) {
  return JsonValue::object({{"ate_rmse_m", error.position_m.rmse},
                            {"ate_mean_m", error.position_m.mean},
                            {"ate_median_m", error.position_m.median},
                            {"ate_max_m", error.position_m.max},
                            {"rotation_rmse_rad", error.rotation_rad.rmse},
                            {"rpe_translation_rmse_m", error.rpe_translation_m.rmse},
                            {"rpe_rotation_rmse_rad", error.rpe_rotation_rad.rmse},
                            {"pairs", error.pairs},
                            {"relative_pairs", error.relative.size()},
                            {"truth_path_m", error.truth_path_m},
                            {"alignment_scale_ratio", error.alignment.scale},
                            {"alignment_degenerate", error.alignment_degenerate}});
}

std::string to_text(const TrajectoryError& error) {
  std::string text = fmt::format(
      "{} pairs of poses, true path {:.2f} m\n"
      "absolute error (ATE)    rmse {:.4f} m, median {:.4f} m, max {:.4f} m\n"
      "relative error (RPE)    rmse {:.4f} m and {:.3f} deg\n",
      error.pairs, error.truth_path_m, error.position_m.rmse, error.position_m.median, error.position_m.max,
      error.rpe_translation_m.rmse, error.rpe_rotation_rad.rmse * kDegrees);
  if (error.alignment.scale != 1.0)
    text += fmt::format("scale of the fit        {:.5f}\n", error.alignment.scale);
  if (error.alignment_degenerate)
    text += "the true path is straight: the orientation of the fit is not determined\n";
  return text;
}

std::string trajectory_report_html(const TrajectoryError& error, const std::string& title) {
  HtmlReport report(title);
  report.set_verdict(HtmlReport::Verdict::kNone,
                     fmt::format("The path of {:.1f} m is off by {:.1f} mm (rmse of {} positions).",
                                 error.truth_path_m, error.position_m.rmse * 1e3, error.pairs));
  report.add_card({"ATE", fmt::format("{:.4f}", error.position_m.rmse), "m", "rmse after alignment"});
  report.add_card({"RPE", fmt::format("{:.4f}", error.rpe_translation_m.rmse), "m", "rmse, translation"});
  report.add_card(
      {"RPE", fmt::format("{:.3f}", error.rpe_rotation_rad.rmse * kDegrees), "deg", "rmse, rotation"});
  Trajectory truth, estimate;
  PlotSeries position{"position error", {}, error.position_errors_m, SeriesStyle::kLine};
  for (const PosePair& pair : error.matched) {
    truth.push_back({pair.stamp, pair.T_world_truth});
    estimate.push_back({pair.stamp, pair.T_world_estimate});
    position.x.push_back((pair.stamp - error.matched.front().stamp).seconds());
  }
  PlotSeries relative{"relative error", {}, {}, SeriesStyle::kLine};
  for (const RelativeError& span : error.relative) {
    relative.x.push_back((span.stamp - error.matched.front().stamp).seconds());
    relative.y.push_back(span.translation_m);
  }
  report.begin_section("From above");
  const std::array<NamedTrajectory, 2> paths{{{"truth", &truth}, {"estimate", &estimate}}};
  PlotOptions map;
  map.equal_aspect = true;
  map.x.label = "x (m)", map.y.label = "y (m)";
  report.add_svg(trajectory_svg(paths, map), "Both paths, the estimate aligned.");
  report.begin_section("Over time");
  PlotOptions over_time;
  over_time.x.label = "time (s)", over_time.y.label = "error (m)";
  report.add_svg(plot_svg(std::span(&position, 1), over_time), "Absolute position error.");
  report.add_svg(plot_svg(std::span(&relative, 1), over_time), "Relative translation error of each span.");
  return report.html();
}

}  // namespace hm
