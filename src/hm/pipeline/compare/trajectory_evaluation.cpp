#include "hm/pipeline/compare/trajectory_evaluation.hpp"

#include <algorithm>
#include <array>
#include <set>

#include "hm/core/angle.hpp"
#include "hm/core/text/add_once.hpp"
#include "hm/io/bytes/json.hpp"
#include "hm/io/pose/trajectory_file.hpp"
#include "hm/io/rgbd/recording.hpp"
#include "hm/pipeline/common/reading_warnings.hpp"
#include "hm/pipeline/common/truth_comparison.hpp"
#include "hm/report/trajectory_plots.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;

enum class PosesOfRecording { kReported, kTrue };

struct ReadPoses {
  Trajectory poses;
  fs::path source;                               ///< file, or files, that they were read from
  bool has_stamps = true, names_frames = false;  ///< as in TrajectoryFile
};

/// Where a file is not there: what names the trajectory of the same folder with another ending, if any.
std::string with_other_ending(const fs::path& missing) {
  std::error_code code;
  for (const char* ending : {".tum", ".txt", ".csv", ".kitti", ".log"}) {
    fs::path other = missing;
    other.replace_extension(ending);
    if (fs::is_regular_file(other, code)) return fmt::format("; there is {}", other.string());
  }
  return {};
}

Result<ReadPoses> read_poses_of_file(const fs::path& path, std::vector<std::string>& warnings) {
  auto file = read_trajectory_file(path);
  if (!file) {
    Error error = file.error();
    if (error.code == ErrorCode::kNotFound) error.message += with_other_ending(path);
    return tl::make_unexpected(std::move(error));
  }
  for (const SkippedLines& skipped : file->skipped) add_once(warnings, to_string(skipped));
  return ReadPoses{std::move(file->poses), path, file->has_stamps, file->names_frames};
}

/// A trajectory file, or the poses of a recording: those that its device reports, or the true ones.
Result<ReadPoses> read_poses(const fs::path& path, PosesOfRecording which,
                             std::vector<std::string>& warnings) {
  std::error_code code;
  if (!fs::is_directory(path, code)) return read_poses_of_file(path, warnings);
  auto recording = open_recording(path);
  if (!recording) return forward_error(recording);
  const RecordingInfo& info = (*recording)->info();
  if (info.trajectory.empty() && info.truth.empty() && !info.poses_unreadable.empty())
    return fail(ErrorCode::kCorrupted, path, "its poses cannot be used: {}", info.poses_unreadable);
  for (std::string& warning : reading_warnings(info)) add_once(warnings, std::move(warning));
  if (which == PosesOfRecording::kTrue) return ReadPoses{true_trajectory(info), truth_source(info)};
  return ReadPoses{info.trajectory, pose_source(info)};
}

/// Error where nothing says which poses of the two belong together, or where a span of seconds is wanted of
/// poses without stamps.
Result<void> check_stamps(const ReadPoses& truth, const ReadPoses& estimate,
                          const TrajectoryErrorParams& params) {
  if (truth.poses.empty() || (truth.has_stamps && estimate.has_stamps)) return {};
  if (truth.has_stamps != estimate.has_stamps)
    return fail(ErrorCode::kInvalidValue, truth.has_stamps ? estimate.source : truth.source,
                "the {} has {} poses without stamps, and the {} {} with stamps: which belong together is not "
                "known. Give both stamps (TUM, EuRoC), or neither",
                truth.has_stamps ? "estimate" : "truth",
                truth.has_stamps ? estimate.poses.size() : truth.poses.size(),
                truth.has_stamps ? "truth" : "estimate",
                truth.has_stamps ? truth.poses.size() : estimate.poses.size());
  const bool both_name_frames = truth.names_frames && estimate.names_frames;
  if (!both_name_frames && truth.poses.size() != estimate.poses.size())
    return fail(ErrorCode::kInvalidValue, estimate.source,
                "the estimate has {} poses without stamps, and the truth {}: which belong together is not "
                "known. Give both stamps (TUM, EuRoC), or compare as many poses",
                estimate.poses.size(), truth.poses.size());
  if (params.rpe_unit == RpeUnit::kSeconds)
    return fail(ErrorCode::kInvalidValue, estimate.source,
                "poses without stamps have no error over seconds: set trajectory_error.rpe_unit to frames or "
                "metres");
  return {};
}

/// A warning where the estimate has another size than the truth; empty otherwise.
std::string size_warning(const EvaluatedTrajectory& estimate, TrajectoryAlignment alignment) {
  const std::string size = wrong_size_in_words(estimate.error);
  if (size.empty()) return {};
  return fmt::format("{}: {}{}", estimate.path.string(), size,
                     alignment == TrajectoryAlignment::kSim3
                         ? ""
                         : "; is it in another unit? `--alignment sim3` fits the size too");
}

/// The file of the poses that a result beside this trajectory was built with; empty where none says so.
fs::path poses_it_was_built_with(const fs::path& trajectory) {
  constexpr std::size_t kMostBytes = std::size_t{1} << 26;
  if (trajectory.filename() != "trajectory.tum") return {};
  const auto json = read_json_file(trajectory.parent_path() / "report.json", kMostBytes);
  return json ? fs::path(json->text_at("poses")) : fs::path();
}

bool is_same_place(const fs::path& a, const fs::path& b) {
  std::error_code code;
  return !a.empty() && !b.empty() && fs::weakly_canonical(a, code) == fs::weakly_canonical(b, code);
}

/// A warning where the two have one source; empty otherwise.
std::string one_source_warning(const EvaluatedTrajectory& estimate, const fs::path& estimate_source,
                               const fs::path& truth_source) {
  if (is_of_one_source(estimate.error))
    return fmt::format(
        "{} has the poses of the truth, so the errors are those of rounding and measure nothing: compare a "
        "trajectory that was estimated without them, by `hm odometry` or `hm slam`",
        estimate.path.string());
  if (is_same_place(poses_it_was_built_with(estimate_source), truth_source))
    return fmt::format(
        "{} was built with the poses that are now the truth ({}): the errors are what the run changed, not "
        "how accurate it is",
        estimate.path.string(), truth_source.string());
  return {};
}

/// The last parts of a path.
fs::path last_parts(const fs::path& path, int parts) {
  fs::path name, rest = path.lexically_normal();
  if (!rest.has_filename()) rest = rest.parent_path();
  for (int i = 0; i < parts && rest.has_filename(); ++i) {
    name = name.empty() ? rest.filename() : rest.filename() / name;
    rest = rest.parent_path();
  }
  return name;
}

/// Names each by the last parts of its path that differ, without a file name that all share.
void name_trajectories(std::vector<EvaluatedTrajectory>& estimates) {
  constexpr int kMostParts = 8;
  std::set<fs::path> files, names;
  for (const EvaluatedTrajectory& estimate : estimates) files.insert(last_parts(estimate.path, 1));
  for (int parts = 1; parts <= kMostParts && names.size() < estimates.size(); ++parts) {
    names.clear();
    for (EvaluatedTrajectory& estimate : estimates) {
      const fs::path name = last_parts(estimate.path, parts);
      names.insert(name);
      estimate.name = (files.size() == 1 && parts > 1 ? name.parent_path() : name).string();
    }
  }
}

void add_relative(SummaryTree& v, const std::string& name, const RelativeErrors& errors) {
  if (errors.spans.empty()) return;
  v({name + "_m", {}, "{:.4f} m"}, errors.translation_m.rmse);
  v({name + "_rad", {}, "{:.3f} deg", kDegreesPerRadian}, errors.rotation_rad.rmse);
  v.shown(name + "_spans", {}, errors.spans.size());
}

void add_rotations(SummaryTree& v, const TrajectoryError& error) {
  v.or_null({"rotation_rmse_rad", {}, "{:.3f} deg", kDegreesPerRadian}, rotation_rmse_rad(error));
  v({"rotation_own_rmse_rad", {}, "{:.3f} deg", kDegreesPerRadian}, error.rotation_own_rad.rmse);
  v({"alignment_uncertainty_rad", {}, "{:.3f} deg", kDegreesPerRadian}, error.alignment_uncertainty_rad);
  v({"rotation_undetermined"}, error.rotation_undetermined);
  if (error.rotation_undetermined)
    v.shown("rotation_undetermined_text", {}, "undetermined after the alignment by positions, see below");
  v.shown("rotation_max_rad", {}, fmt::format("{:.3f} deg", error.rotation_rad.max * kDegreesPerRadian));
  v.shown("rotation_own_max_rad", {},
          fmt::format("{:.3f} deg", error.rotation_own_rad.max * kDegreesPerRadian));
}

std::string text_of_one(const TrajectoryError& error) {
  const SummaryTree tree = describe(error);
  std::string text = tree.lines(
      {"{pairs|pair of poses|pairs of poses}, true path {truth_path_m}, estimated path {estimate_path_m}",
       "absolute error (ATE)    rmse {ate_rmse_m}, median {ate_median_m}, max {ate_max_m}",
       "without alignment       rmse {ate_given_rmse_m}, median {ate_given_median_m}, max {ate_given_max_m}",
       "orientation             rmse {rotation_rmse_rad}, max {rotation_max_rad}",
       "orientation             {rotation_undetermined_text}",
       "  aligned on its own      rmse {rotation_own_rmse_rad}, max {rotation_own_max_rad}",
       "relative error (RPE)",
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
  if (const std::string note = undetermined_rotation_note(error); !note.empty()) text += note + "\n";
  return text;
}

/// A row for each trajectory, positions in metres.
std::string text_of_several(const std::vector<EvaluatedTrajectory>& estimates) {
  std::size_t width = 10;
  for (const EvaluatedTrajectory& estimate : estimates) width = std::max(width, estimate.name.size());
  std::string text = fmt::format("{:{}} {:>7} {:>34}   {:>34}\n{:{}} {:>7}", "position error (m)", width + 3,
                                 "", "aligned", "as given", "trajectory", width + 3, "poses");
  for (int i = 0; i < 2; ++i)
    text += fmt::format(" {:>8} {:>8} {:>8} {:>8}{}", "mean", "median", "rmse", "max", i == 0 ? "  " : "\n");
  for (const EvaluatedTrajectory& estimate : estimates) {
    text += fmt::format("{:{}} {:>7}", estimate.name, width + 3, estimate.error.pairs);
    for (const Summary* s : {&estimate.error.position_m, &estimate.error.position_given_m})
      text += fmt::format(" {:8.4f} {:8.4f} {:8.4f} {:8.4f}{}", s->mean, s->median, s->rmse, s->max,
                          s == &estimate.error.position_m ? "  " : "\n");
  }
  return text;
}

}  // namespace

Result<TrajectoryComparison> evaluate_trajectory_files(std::span<const fs::path> estimates,
                                                       const fs::path& truth,
                                                       const TrajectoryErrorParams& params) {
  TrajectoryComparison comparison{truth, {}, {}};
  const auto true_poses = read_poses(truth, PosesOfRecording::kTrue, comparison.warnings);
  if (!true_poses) return forward_error(true_poses);
  for (const fs::path& path : estimates) {
    const auto estimated = read_poses(path, PosesOfRecording::kReported, comparison.warnings);
    if (!estimated) return forward_error(estimated);
    if (const auto checked = check_stamps(*true_poses, *estimated, params); !checked)
      return forward_error(checked);
    auto error = evaluate_trajectory(true_poses->poses, estimated->poses, params);
    if (!error) {
      const fs::path& at_fault = error.error().where != kTrueTrajectory ? path
                                 : true_poses->source.empty()           ? truth
                                                                        : true_poses->source;
      return fail(error.error().code, at_fault.string(), "{}", error.error().message);
    }
    if (!estimated->has_stamps) error->per_second = {RpeUnit::kSeconds, 1, {}, {}, {}};
    const EvaluatedTrajectory& added = comparison.estimates.emplace_back(
        EvaluatedTrajectory{.name = {}, .path = path, .error = std::move(*error)});
    for (std::string& warning : std::array{one_source_warning(added, estimated->source, true_poses->source),
                                           size_warning(added, params.alignment)})
      if (!warning.empty()) comparison.warnings.push_back(std::move(warning));
  }
  name_trajectories(comparison.estimates);
  return comparison;
}

void visit(const TrajectoryError& error, SummaryTree& v) {
  v({"ate_rmse_m", {}, "{:.4f} m"}, error.position_m.rmse);
  v({"ate_mean_m", {}, "{:.4f} m"}, error.position_m.mean);
  v({"ate_median_m", {}, "{:.4f} m"}, error.position_m.median);
  v({"ate_max_m", {}, "{:.4f} m"}, error.position_m.max);
  v({"ate_given_rmse_m", {}, "{:.4f} m"}, error.position_given_m.rmse);
  v({"ate_given_mean_m", {}, "{:.4f} m"}, error.position_given_m.mean);
  v({"ate_given_median_m", {}, "{:.4f} m"}, error.position_given_m.median);
  v({"ate_given_max_m", {}, "{:.4f} m"}, error.position_given_m.max);
  add_rotations(v, error);
  v({"rpe_translation_rmse_m", {}, "{:.4f} m"}, error.relative.translation_m.rmse);
  v({"rpe_rotation_rmse_rad", {}, "{:.3f} deg", kDegreesPerRadian}, error.relative.rotation_rad.rmse);
  v({"pairs"}, error.pairs);
  v({"relative_pairs"}, error.relative.spans.size());
  v({"truth_path_m", {}, "{:.2f} m"}, error.truth_path_m);
  v({"estimate_path_m", {}, "{:.2f} m"}, error.estimate_path_m);
  v.or_null({"size_ratio", {}, "{:.3f}"}, error.size_ratio);
  v({"wrong_size"}, error.wrong_size);
  v({"alignment_scale_ratio", {}, "{:.5f}"}, error.alignment.scale);
  add_relative(v, "rpe_frame", error.per_frame);
  add_relative(v, "rpe_second", error.per_second);
  add_relative(v, "rpe_metre", error.per_metre);
}

void visit(const TrajectoryComparison& comparison, SummaryTree& v) {
  const auto& estimates = comparison.estimates;
  if (estimates.size() == 1) return visit(estimates.front().error, v);
  v.list_of("trajectories", estimates.size(), [&](std::size_t i, SummaryTree& row) {
    row({"name"}, estimates[i].name);
    row({"path"}, estimates[i].path.string());
    visit(estimates[i].error, row);
  });
}

std::string to_text(const TrajectoryComparison& comparison) {
  return comparison.estimates.size() == 1 ? text_of_one(comparison.estimates.front().error)
                                          : text_of_several(comparison.estimates);
}

}  // namespace hm
