#include "hm/pipeline/laser/laser_evaluation.hpp"

#include "hm/core/text/counted.hpp"
#include "hm/io/pose/relations_file.hpp"
#include "hm/pipeline/common/truth_comparison.hpp"

namespace hm {
namespace {

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
  }
  if (!options.relations.empty()) compare_with_relations(recording, options, summary);
}

}  // namespace hm
