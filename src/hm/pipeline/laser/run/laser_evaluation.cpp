#include "hm/pipeline/laser/run/laser_evaluation.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

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

double yaw_between(const SE3& a, const SE3& b) {
  return (SE2::from_se3(a).inverse() * SE2::from_se3(b)).angle();
}

/// Scans whose beams are spread over another angle than they were taken in, or mirrored, match well and give
/// a map that is bent: it turns less, more, or the other way than the vehicle did.
void judge_turns(const LaserRecording& recording, const LaserSummary& summary, RunVerdict& verdict) {
  constexpr double kLeastRatio = 0.8, kMostRatio = 1.25;
  if (!summary.matched_scans || recording.odometry.empty()) return;
  const std::optional<double> ratio = turn_ratio(summary.trajectory_odom, recording.odometry);
  if (!ratio || (*ratio >= kLeastRatio && *ratio <= kMostRatio)) return;
  verdict.add(MapVerdict::kDoubtful,
              fmt::format("by scan matching the vehicle turns {:.2f} times as far as by its odometry: the "
                          "angles of the beams, or the turns of odometry, are wrong",
                          *ratio));
}

/// Between bare walls, without wheels, the length is extrapolated from the velocity, which errs by a tenth or
/// more: by half a metre after 5 m. One that begins there has no velocity at all. A saved map shows the
/// place.
void judge_lengths(const LaserSummary& summary, RunVerdict& verdict) {
  constexpr double kLongest_m = 5, kMostUnobserved = 0.5;
  if (summary.map_frame.localisation) return;
  const double unobserved_ratio = static_cast<double>(summary.scans_length_unobserved) /
                                  static_cast<double>(std::max<std::size_t>(1, summary.scans_matched));
  if (summary.longest_guess_m > kLongest_m)
    verdict.add(MapVerdict::kDoubtful,
                fmt::format("the length of {:.0f} m between bare walls is extrapolated from the velocity "
                            "({:.0f} m in all)",
                            summary.longest_guess_m, summary.guessed_m));
  if (unobserved_ratio > kMostUnobserved)
    verdict.add(MapVerdict::kDoubtful, fmt::format("{:.0f} % of the scans show nothing of the motion along "
                                                   "walls, and no odometry does",
                                                   100 * unobserved_ratio));
}

/// A path that no loop checks is known from odometry and from the matches of its keyframes. On tuning halves
/// and beginnings of tuning floors the two differ by 1.3 degrees at most, by 5 where odometry was wrong, and
/// by 5 to 14 on a rover's path that is bent.
void judge_unchecked_turns(const LaserSummary& summary, RunVerdict& verdict) {
  constexpr double kMost_rad = 0.05;
  const UncheckedTurn& turn = summary.map_frame.registration.unchecked;
  if (turn.angle_rad <= kMost_rad) return;
  const Time begin = summary.trajectory_odom.front().stamp;
  verdict.add(
      MapVerdict::kDoubtful,
      fmt::format("between {:.1f} and {:.1f} s after the start the path may be bent: scans matched one "
                  "after another turn it by {:.1f} degrees more or less than matched with all around, "
                  "and no loop says which is right",
                  (turn.from - begin).seconds(), (turn.to - begin).seconds(),
                  turn.angle_rad * 180 / std::numbers::pi));
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

std::optional<double> turn_ratio(const Trajectory& matched, const Trajectory& odometry) {
  // A turn is measured over so much of it, and at most so long.
  constexpr double kTurn_rad = 0.3, kLongest_s = 3;
  constexpr double kLeastTurned_rad = 1, kMinCorrelation = 0.8;
  double of_odometry = 0, of_matching = 0, of_both = 0, turned_rad = 0;
  std::optional<SE3> odometry_begin;
  std::size_t begin = 0;
  for (std::size_t i = 0; i < matched.size(); ++i) {
    const auto now = pose_at(odometry, matched[i].stamp, Duration::from_seconds(1));
    if (!now || !odometry_begin) {
      odometry_begin = now, begin = i;
      continue;
    }
    const double by_odometry = yaw_between(*odometry_begin, *now);
    const double by_matching = yaw_between(matched[begin].T_world_base, matched[i].T_world_base);
    const bool is_turn = std::max(std::abs(by_odometry), std::abs(by_matching)) >= kTurn_rad;
    if (!is_turn && (matched[i].stamp - matched[begin].stamp).seconds() < kLongest_s) continue;
    of_odometry += by_odometry * by_odometry;
    of_matching += by_matching * by_matching;
    of_both += by_odometry * by_matching;
    turned_rad += std::abs(by_odometry);
    odometry_begin = now, begin = i;
  }
  const double correlation = of_both / std::sqrt(of_odometry * of_matching);
  if (turned_rad < kLeastTurned_rad || !(std::abs(correlation) >= kMinCorrelation)) return std::nullopt;
  return std::copysign(std::sqrt(of_matching / of_odometry), correlation);
}

RunVerdict judge_laser_run(const LaserRecording& recording, const LaserSummary& summary,
                           const ScanVisits& visits, const LaserMapFrame& frame) {
  RunVerdict verdict;
  if (!summary.trajectory_odom.empty())
    judge_visits(compare_visits(visits, frame, summary.trajectory_odom.front().stamp), kLaserVisitLimits,
                 "scans", verdict);
  judge_failures(summary, verdict);
  judge_lengths(summary, verdict);
  judge_turns(recording, summary, verdict);
  judge_unchecked_turns(summary, verdict);
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
