#include "hm/pipeline/laser/run/laser_evaluation.hpp"

#include <Eigen/LU>
#include <algorithm>

#include "hm/core/text/counted.hpp"
#include "hm/io/pose/relations_file.hpp"
#include "hm/pipeline/common/truth_comparison.hpp"

namespace hm {
namespace {

constexpr double kWrongLoopDeviations = 4, kLoopError_m = 0.1, kLoopError_rad = 0.03;
constexpr double kMaxTruthGap_s = 1;

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

std::vector<VisitComparison> compare_visits(const ScanVisits& visits, const LaserMapFrame& frame,
                                            Time begin) {
  std::vector<VisitComparison> comparisons;
  const auto T_map_base = [&](Time stamp, const SE2& T_odom_base) {
    return frame.T_map_odom_at(stamp, T_odom_base) * T_odom_base;
  };
  for (const VisitAgreement& agreement : visits.compare(T_map_base))
    comparisons.push_back(
        {(agreement.stamp - begin).seconds(), agreement.contradicted_ratio(), agreement.place_m});
  return comparisons;
}

void judge_failures(const LaserSummary& summary, RunVerdict& verdict) {
  judge_missing_poses(summary.scans_failed, summary.scans_read, "scans", verdict);
  if (summary.restarts > 0)
    verdict.add(MapVerdict::kDoubtful,
                fmt::format("scan matching was lost and restarted {}", counted(summary.restarts, "time")));
  if (const auto& place = summary.map_frame.localisation; place && !place->is_sure())
    verdict.add(MapVerdict::kDoubtful,
                fmt::format("the place in the saved map is doubtful (median score {:.2f}, lost {})",
                            place->score.median, counted(place->lost, "time")));
}

}  // namespace

std::optional<std::size_t> count_wrong_loops(const ScanGraph2D& graph, const Trajectory& truth) {
  const auto true_pose = [&](std::size_t node) {
    return pose_at(truth, graph.keyframe(node).scan.stamp, Duration::from_seconds(kMaxTruthGap_s));
  };
  const Mat3 least = Vec3(kLoopError_m, kLoopError_m, kLoopError_rad).cwiseAbs2().asDiagonal();
  std::optional<std::size_t> wrong;
  for (const PoseEdge2D& edge : graph.graph().edges) {
    if (edge.kind != PoseEdgeKind::kLoop) continue;
    const auto from = true_pose(edge.from), to = true_pose(edge.to);
    if (!from || !to) continue;
    const Vec3 error = pose_edge_error(edge, SE2::from_se3(*from), SE2::from_se3(*to));
    const Mat3 covariance = edge.information.inverse() + least;
    const bool contradicted =
        error.dot(covariance.inverse() * error) > kWrongLoopDeviations * kWrongLoopDeviations;
    wrong = wrong.value_or(0) + (contradicted ? 1 : 0);
  }
  return wrong;
}

RunVerdict judge_laser_run(const LaserSummary& summary, const ScanVisits& visits,
                           const LaserMapFrame& frame) {
  RunVerdict verdict;
  if (!summary.trajectory_odom.empty())
    judge_visits(compare_visits(visits, frame, summary.trajectory_odom.front().stamp), kLaserVisitLimits,
                 "scans", verdict);
  judge_failures(summary, verdict);
  return verdict;
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
  }
  if (!options.relations.empty()) compare_with_relations(recording, options, summary);
}

}  // namespace hm
