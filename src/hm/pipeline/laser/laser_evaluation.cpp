#include "hm/pipeline/laser/laser_evaluation.hpp"

#include <algorithm>
#include <cmath>

#include "hm/core/text/counted.hpp"
#include "hm/io/pose/relations_file.hpp"
#include "hm/pipeline/common/truth_comparison.hpp"

namespace hm {
namespace {

constexpr double kTruthMaxGap_s = 0.1;

void compare_with_relations(const LaserRecording& recording, const LaserRunOptions& options,
                            LaserSummary& summary) {
  auto list = read_relations(options.relations);
  if (!list) {
    summary.warnings.push_back("the relations cannot be used: " + to_string(list.error()));
    return;
  }
  auto& relations = list->relations;
  correct_relations(relations, recording.corrected_stamps);
  auto errors = evaluate_relations(summary.trajectory, relations, summary.parameters.relation_error);
  if (!errors) {
    summary.warnings.push_back("the relations cannot be compared: " + to_string(errors.error()));
    return;
  }
  if (errors->unmatched > 0)
    summary.warnings.push_back(
        fmt::format("{} of {} {} no pose at {} times", with_thousands(errors->unmatched),
                    counted(relations.size(), "relation"), errors->unmatched == 1 ? "has" : "have",
                    errors->unmatched == 1 ? "its" : "their"));
  summary.relation_error = std::move(*errors);
  if (!summary.map_frame.corrected) return;
  auto odom = evaluate_relations(summary.trajectory_odom, relations, summary.parameters.relation_error);
  if (odom) summary.relation_error_odom = std::move(*odom);
}

}  // namespace

std::optional<HeightError> evaluate_height(const Trajectory& truth,
                                           std::span<const LaserScanRecord> records) {
  std::vector<double> differences;
  for (const LaserScanRecord& record : records) {
    if (!record.step.height || record.step.height->status != HeightStatus::kOk) continue;
    const auto T_world_base =
        pose_at(truth, record.step.height->stamp, Duration::from_seconds(kTruthMaxGap_s));
    if (T_world_base) differences.push_back(T_world_base->translation().z() - record.step.height->height_m);
  }
  if (differences.size() < 3) return std::nullopt;
  HeightError error;
  error.pairs = differences.size();
  error.offset_m = quantile(differences, 0.5);
  for (double& difference : differences) difference = std::abs(difference - error.offset_m);
  const Summary sizes = summarise(differences);
  error.rmse_m = sizes.rmse, error.max_m = sizes.max;
  return error;
}

void evaluate_laser_run(const LaserRecording& recording, const LaserRunOptions& options,
                        LaserSummary& summary) {
  if (!recording.truth.empty()) {
    auto error = evaluate_written(recording.truth, summary.trajectory, summary.parameters.trajectory_error);
    if (error)
      summary.error = std::move(*error);
    else
      summary.warnings.push_back("the trajectory cannot be compared with the truth: " +
                                 to_string(error.error()));
    if (summary.map_frame.corrected)
      if (auto odom =
              evaluate_written(recording.truth, summary.trajectory_odom, summary.parameters.trajectory_error))
        summary.error_odom = std::move(*odom);
    summary.height_error = evaluate_height(recording.truth, summary.records);
  }
  if (!options.relations.empty()) compare_with_relations(recording, options, summary);
}

}  // namespace hm
