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

void add_relative(JsonValue& json, const std::string& name, const RelativeErrors& errors) {
  if (errors.spans.empty()) return;
  json[name + "_m"] = errors.translation_m.rmse;
  json[name + "_rad"] = errors.rotation_rad.rmse;
}

std::string relative_text(const char* span, const RelativeErrors& errors) {
  if (errors.spans.empty()) return {};
  return fmt::format("  over {:<18} rmse {:.4f} m and {:.3f} deg ({} spans)\n", span,
                     errors.translation_m.rmse, errors.rotation_rad.rmse * kDegreesPerRadian,
                     errors.spans.size());
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

JsonValue to_json(const TrajectoryError& error) {
  auto json = JsonValue::object({{"ate_rmse_m", error.position_m.rmse},
                                 {"ate_mean_m", error.position_m.mean},
                                 {"ate_median_m", error.position_m.median},
                                 {"ate_max_m", error.position_m.max},
                                 {"rotation_rmse_rad", error.rotation_rad.rmse},
                                 {"rpe_translation_rmse_m", error.relative.translation_m.rmse},
                                 {"rpe_rotation_rmse_rad", error.relative.rotation_rad.rmse},
                                 {"pairs", error.pairs},
                                 {"relative_pairs", error.relative.spans.size()},
                                 {"truth_path_m", error.truth_path_m},
                                 {"alignment_scale_ratio", error.alignment.scale},
                                 {"alignment_degenerate", error.alignment_degenerate}});
  add_relative(json, "rpe_frame", error.per_frame);
  add_relative(json, "rpe_second", error.per_second);
  add_relative(json, "rpe_metre", error.per_metre);
  return json;
}

std::string to_text(const TrajectoryError& error) {
  std::string text = fmt::format(
      "{} pairs of poses, true path {:.2f} m\n"
      "absolute error (ATE)    rmse {:.4f} m, median {:.4f} m, max {:.4f} m\n"
      "orientation             rmse {:.3f} deg, max {:.3f} deg\n"
      "relative error (RPE)\n",
      error.pairs, error.truth_path_m, error.position_m.rmse, error.position_m.median, error.position_m.max,
      error.rotation_rad.rmse * kDegreesPerRadian, error.rotation_rad.max * kDegreesPerRadian);
  text += relative_text("a frame", error.per_frame) + relative_text("a second", error.per_second) +
          relative_text("a metre", error.per_metre);
  if (error.relative.delta != 1) {
    const auto unit = kRpeUnitNames[static_cast<std::size_t>(error.relative.unit)];
    text += relative_text(fmt::format("{:g} {}", error.relative.delta, unit).c_str(), error.relative);
  }
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
  if (!error.per_second.spans.empty()) {
    report.add_card(
        {"RPE", fmt::format("{:.4f}", error.per_second.translation_m.rmse), "m", "rmse, a second"});
    report.add_card({"RPE", fmt::format("{:.3f}", error.per_second.rotation_rad.rmse * kDegreesPerRadian),
                     "deg", "rmse, a second"});
  }
  const Trajectory truth = matched_truth(error), estimate = matched_estimate(error);
  report.begin_section("Path");
  const std::array<NamedTrajectory, 2> paths{{{"truth", &truth}, {"estimate", &estimate}}};
  add_path_views(report, paths, "The estimate is fitted to the truth.");
  report.begin_section("Relative errors", "Of the motion over spans of one length, not divided by it.");
  add_relative_table(report, error);
  report.begin_section("Over time");
  add_error_plots(report, error);
  return report.html();
}

}  // namespace hm
