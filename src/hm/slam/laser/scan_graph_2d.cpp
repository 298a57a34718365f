#include "hm/slam/laser/scan_graph_2d.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "hm/core/check.hpp"
#include "hm/geometry/planar_covariance.hpp"
#include "hm/slam/laser/loop_consistency.hpp"

namespace hm {
namespace {

/// Standard deviation of odometry's motion in directions that the matcher does not determine.
constexpr double kMotionSigma_m = 0.1, kMotionSigma_rad = 0.05, kMotionSigmaRatio = 0.2;
constexpr int kMaxTakeOutRounds = 4;
/// A loop that moves its keyframe further needs another one that agrees: between places that look
/// alike there are loops, but seldom two that fit one correction.
constexpr double kAloneCorrection_m = 0.5;
/// Where the graph as it is lets so much of the trail contradict the way, a loop that makes both agree
/// needs no other one, if none that disagrees waits. Nor does it need to hold the direction along a corridor,
/// if it moves across it by less than half a corridor's width: by more it might be the one beside it.
constexpr double kContradictedAsItIs = 0.5, kMostAcross_m = 1.2;
/// Minimum half width of the window of a repeated search.
constexpr double kMinRepeatedWindow_m = 1.5;
/// After a loop with a larger correction the graph is optimised before the next search.
constexpr double kLargeCorrection_m = 0.3, kLargeTurn_rad = 0.04;
/// After loops that correct less, and of which one holds the place, so many keyframes are not searched for
/// loops: the graph is right there, and odometry does not drift far in a metre and a half.
constexpr double kSmallCorrection_m = 0.2, kSmallTurn_rad = 0.02;
constexpr std::size_t kNotSearched = 3;
/// Maximum number of nearest submaps whose uncertainty is computed, however often a place was visited.
constexpr std::size_t kMostCandidates = 64;

/// Covariance of a motion of odometry that nothing measured, only the motion before predicts.
Mat3 motion_prior(const SE2& motion) {
  const double sigma_m = kMotionSigma_m + kMotionSigmaRatio * motion.translation().norm();
  const double sigma_rad = kMotionSigma_rad + kMotionSigmaRatio * std::abs(motion.angle());
  return Vec3(sigma_m, sigma_m, sigma_rad).cwiseAbs2().asDiagonal();
}

/// Matcher covariance, scaled and increased by the errors that it does not include.
Mat3 honest_covariance(const Mat3& covariance, const ScanGraph2DParams& params) {
  Mat3 sum = params.kEdgeCovarianceScale * covariance;
  sum.diagonal() += Vec3(params.kEdgeSigma_m, params.kEdgeSigma_m, params.kEdgeSigma_rad).cwiseAbs2();
  return sum;
}

SE2 between(const SE2& a, const SE2& b, double fraction) {
  return a * SE2::exp(fraction * (a.inverse() * b).log());
}

}  // namespace

bool ScanGraphStep::corrects_much() const {
  return largest_correction_m > kLargeCorrection_m || largest_turn_rad > kLargeTurn_rad;
}

bool ScanGraphStep::confirms_graph() const {
  return holds_place && largest_correction_m < kSmallCorrection_m && largest_turn_rad < kSmallTurn_rad;
}

ScanGraph2D::ScanGraph2D(const ScanGraph2DParams& params) : params_(params), finder_(params) {}

ScanGraphStep ScanGraph2D::add_keyframe(GraphKeyframe2D keyframe) {
  HM_CHECK(keyframe.T_odom_base.vector().allFinite() && keyframe.covariance.allFinite(),
           "keyframe {} is not finite", keyframes_.size());
  HM_CHECK(keyframes_.empty() || keyframe.scan.stamp > keyframes_.back().scan.stamp,
           "the stamp of keyframe {} is not later than the last one", keyframes_.size());
  keyframes_.push_back(std::move(keyframe));
  paths_.add_node();
  ScanGraphStep step;
  step.node = keyframes_.size() - 1;
  if (submaps_.empty() ||
      submaps_.back().end - submaps_.back().first >= static_cast<std::size_t>(params_.kSubmapKeyframes))
    submaps_.push_back({step.node, step.node});
  ++submaps_.back().end;
  add_odometry_edge();
  forget_waiting_before(step.node);
  if (step.node < search_from_ ||
      keyframes_.back().scan.size() < static_cast<std::size_t>(params_.kMinPoints))
    return step;
  for (const Candidate& candidate : loop_candidates(step.node, SearchKind::kFirst)) {
    step.attempts.push_back(try_loop(step.node, candidate, step));
    if (!step.confirms_graph() || !waiting_.empty()) continue;
    search_from_ = step.node + 1 + kNotSearched;
    break;
  }
  return step;
}

void ScanGraph2D::add_odometry_edge() {
  const std::size_t node = keyframes_.size() - 1;
  if (node == 0) {
    graph_.T_map_node.push_back(keyframes_[0].T_odom_base);
    return;
  }
  const SE2 motion = keyframes_[node - 1].T_odom_base.inverse() * keyframes_[node].T_odom_base;
  const Mat3 covariance = fused_covariance(honest_covariance(keyframes_[node].covariance, params_),
                                           keyframes_[node].wheel_covariance.value_or(motion_prior(motion)));
  graph_.T_map_node.push_back(graph_.T_map_node.back() * motion);
  graph_.edges.push_back(
      {node - 1, node, motion, edge_information(motion, covariance), PoseEdgeKind::kOdometry});
  paths_.add_edge(graph_.edges.back());
}

/// Distance of a keyframe from the nearest one of a submap, by apart_m(); infinite if beyond the reach of a
/// search.
double ScanGraph2D::apartness(std::size_t node, const ScanSubmap& submap) const {
  const SE2& T_map_base = graph_.T_map_node[node];
  const double limit_m = params_.kMaxLoopDistance_m + params_.max_window_m;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = submap.first; k < submap.end; ++k) {
    const SE2& T_map_k = graph_.T_map_node[k];
    if ((T_map_k.translation() - T_map_base.translation()).squaredNorm() > limit_m * limit_m) continue;
    least = std::min(least, apart_m(T_map_base.inverse() * T_map_k));
  }
  return least;
}

SearchWindow ScanGraph2D::window_of(std::size_t node, const ScanSubmap& submap,
                                    const PathUncertainty2D::Seen& seen) const {
  const std::size_t anchor = submap.anchor();
  SearchWindow window;
  const SE2 T_base_anchor = graph_.T_map_node[node].inverse() * graph_.T_map_node[anchor];
  window.centre = T_base_anchor.inverse();
  const Mat3 covariance = inverse_covariance(T_base_anchor, seen.covariance);
  Vec3 sigmas = covariance.diagonal().cwiseMax(0).cwiseSqrt();
  if (!seen.reached) sigmas.setConstant(std::numeric_limits<double>::infinity());
  const auto metres = [&](double sigma) {
    const double most_m = params_.max_window_m;
    return std::clamp(params_.kWindowSigmas * sigma, std::min<double>(params_.kMinWindow_m, most_m), most_m);
  };
  window.half_x_m = metres(sigmas.x());
  window.half_y_m = metres(sigmas.y());
  window.half_angle_rad =
      std::clamp(params_.kWindowSigmas * sigmas.z(), params_.kMinWindow_rad, params_.kMaxWindow_rad);
  return window;
}

std::vector<ScanGraph2D::Candidate> ScanGraph2D::loop_candidates(std::size_t node, SearchKind kind) const {
  std::vector<Candidate> candidates;
  if (params_.kMaxSubmapsTried == 0 || submaps_.size() < 2) return candidates;
  std::vector<std::size_t> anchors;
  for (std::size_t s = 0; s + 1 < submaps_.size(); ++s) {
    const ScanSubmap& submap = submaps_[s];
    if (submap.end + static_cast<std::size_t>(params_.kMinKeyframesApart) > node + 1) break;
    if (kind == SearchKind::kRepeated && has_loop_to(node, submap)) continue;
    const double distance_m = apartness(node, submap);
    if (distance_m > params_.kMaxLoopDistance_m + params_.max_window_m) continue;
    candidates.push_back({s, distance_m, {}});
  }
  std::ranges::stable_sort(candidates, {}, &Candidate::distance_m);
  if (candidates.size() > kMostCandidates) candidates.resize(kMostCandidates);
  for (const Candidate& candidate : candidates) anchors.push_back(submaps_[candidate.submap].anchor());
  const std::vector<PathUncertainty2D::Seen> seen = paths_.seen_from(graph_, node, anchors);
  for (std::size_t i = 0; i < candidates.size(); ++i)
    candidates[i].window = window_of(node, submaps_[candidates[i].submap], seen[i]);
  if (kind == SearchKind::kRepeated)
    for (auto& [submap, distance_m, window] : candidates) {
      const double least_m = std::min(kMinRepeatedWindow_m, params_.max_window_m);
      window.half_x_m = std::max(window.half_x_m, least_m);
      window.half_y_m = std::max(window.half_y_m, least_m);
    }
  std::erase_if(candidates, [this](const Candidate& candidate) {
    const SearchWindow& window = candidate.window;
    return candidate.distance_m > params_.kMaxLoopDistance_m + std::max(window.half_x_m, window.half_y_m);
  });
  if (candidates.size() > static_cast<std::size_t>(params_.kMaxSubmapsTried))
    candidates.resize(static_cast<std::size_t>(params_.kMaxSubmapsTried));
  return candidates;
}

LoopAttempt ScanGraph2D::try_loop(std::size_t node, const Candidate& candidate, ScanGraphStep& step,
                                  std::span<const PoseEdge2D> excluded) {
  const FoundLoop found =
      finder_.find(path_to(node), submaps_[candidate.submap], candidate.window, step.loops_accepted == 0);
  LoopAttempt attempt{candidate.submap, found.outcome, found.score, found.window};
  if (found.match) {
    const PoseEdge2D edge = loop_edge(node, *found.match);
    const bool is_excluded = std::ranges::any_of(
        excluded, [&](const PoseEdge2D& loop) { return same_hypothesis(edge, loop, keyframes_); });
    attempt.outcome = is_excluded ? LoopOutcome::kNotVerified : accept(edge, step);
  }
  count(attempt.outcome);
  return attempt;
}

PoseEdge2D ScanGraph2D::loop_edge(std::size_t node, const LoopMatch& match) const {
  return {match.from, node, match.T_from_base,
          edge_information(match.T_from_base, honest_covariance(match.covariance, params_)),
          PoseEdgeKind::kLoop};
}

/// Adds a loop to the graph, or lets it wait for another one that agrees; with such a one both.
LoopOutcome ScanGraph2D::accept(const PoseEdge2D& edge, ScanGraphStep& step) {
  const auto correction_of = [&](const PoseEdge2D& loop) {
    return pose_edge_error(loop, graph_.T_map_node[loop.from], graph_.T_map_node[loop.to]);
  };
  const auto add = [&](const PoseEdge2D& loop) {
    const Vec3 correction = correction_of(loop);
    graph_.edges.push_back(loop);
    if (determines_place(loop)) {
      paths_.add_edge(loop);
      step.holds_place = true;
    }
    ++step.loops_accepted;
    step.largest_correction_m = std::max(step.largest_correction_m, correction.head<2>().norm());
    step.largest_turn_rad = std::max(step.largest_turn_rad, std::abs(correction[2]));
  };
  const double correction_m = correction_of(edge).head<2>().norm();
  const auto agrees = [&](const PoseEdge2D& other) { return loops_agree(edge, other, graph_.T_map_node); };
  const auto waiting = std::ranges::find_if(waiting_, agrees);
  if (correction_m > kAloneCorrection_m) {
    const bool is_held = determines_place(edge);
    if (!is_held && correction_m >= kMostAcross_m) return LoopOutcome::kAmbiguous;
    const MappedKeyframes path = path_to(edge.to);
    if (!trail_agrees(path, edge.from, edge.T_from_to))
      return is_held ? LoopOutcome::kNotVerified : LoopOutcome::kAmbiguous;
    const bool is_agreed = waiting != waiting_.end() || std::ranges::any_of(graph_.edges, agrees);
    // With another loop of this keyframe it is the graph before that loop that is contradicted.
    const auto ends_contradiction = [&] {
      return step.loops_accepted == 0 && waiting_.empty() &&
             contradicted_on_way(path, edge.from) >= kContradictedAsItIs;
    };
    if (!is_agreed && !ends_contradiction()) {
      if (!is_held) return LoopOutcome::kAmbiguous;
      waiting_.push_back(edge);
      return LoopOutcome::kAlone;
    }
  }
  add(edge);
  if (waiting == waiting_.end()) return LoopOutcome::kAccepted;
  add(*waiting);
  waiting_.erase(waiting);
  --statistics_.alone;
  ++statistics_.accepted;
  return LoopOutcome::kAccepted;
}

void ScanGraph2D::count(LoopOutcome outcome) {
  ++statistics_.candidates;
  if (outcome == LoopOutcome::kAccepted) ++statistics_.accepted;
  if (outcome == LoopOutcome::kNoMatch) ++statistics_.no_match;
  if (outcome == LoopOutcome::kAmbiguous) ++statistics_.ambiguous;
  if (outcome == LoopOutcome::kLimitReached) ++statistics_.limit_reached;
  if (outcome == LoopOutcome::kNotVerified) ++statistics_.not_verified;
  if (outcome == LoopOutcome::kAlone) ++statistics_.alone;
}

PoseGraphSolution ScanGraph2D::optimise(std::size_t first) {
  GraphPart<PoseGraph2D> part = part_since(graph_, first);
  PoseGraphSolution solution = solve_pose_graph(part.graph, params_.solver, part.held);
  for (int round = 0; round < kMaxTakeOutRounds && take_out_contradictions(part); ++round)
    solution = solve_pose_graph(part.graph, params_.solver, part.held);
  put_back(part, graph_);
  return solution;
}

void ScanGraph2D::restore(const State& state) {
  HM_CHECK(state.graph.T_map_node.size() == keyframes_.size(), "a state of {} keyframes in a graph of {}",
           state.graph.T_map_node.size(), keyframes_.size());
  graph_ = state.graph;
  paths_ = state.paths;
  statistics_ = state.statistics;
}

void ScanGraph2D::take_out(std::span<const PoseEdge2D> loops) {
  for (const PoseEdge2D& loop : loops) {
    paths_.remove_loop(loop);
    statistics_.removed += std::erase_if(graph_.edges, [&](const PoseEdge2D& edge) {
      return edge.kind == PoseEdgeKind::kLoop && edge.from == loop.from && edge.to == loop.to;
    });
  }
}

bool ScanGraph2D::has_loop_to(std::size_t node, const ScanSubmap& submap) const {
  return std::ranges::any_of(graph_.edges, [&](const PoseEdge2D& edge) {
    return edge.kind == PoseEdgeKind::kLoop && edge.to == node && edge.from >= submap.first &&
           edge.from < submap.end;
  });
}

int ScanGraph2D::search_again(std::span<const std::size_t> nodes, std::span<const PoseEdge2D> excluded,
                              const std::function<bool()>& goes_on) {
  int accepted = 0;
  std::vector<PoseEdge2D> of_newest = std::exchange(waiting_, {});
  for (const std::size_t node : nodes) {
    if (keyframes_[node].scan.size() < static_cast<std::size_t>(params_.kMinPoints)) continue;
    if (goes_on && !goes_on()) break;
    forget_waiting_before(node);
    ScanGraphStep step;
    for (const Candidate& candidate : loop_candidates(node, SearchKind::kRepeated))
      try_loop(node, candidate, step, excluded);
    accepted += step.loops_accepted;
    if (step.corrects_much()) optimise();
  }
  waiting_ = std::move(of_newest);
  return accepted;
}

/// Loops of keyframes that are too far from this one to agree with its loops wait no longer.
void ScanGraph2D::forget_waiting_before(std::size_t node) {
  std::erase_if(waiting_, [&](const PoseEdge2D& loop) { return loop.to + kReachOfAgreement < node; });
}

bool ScanGraph2D::take_out_contradictions(GraphPart<PoseGraph2D>& part) {
  std::size_t removed = 0;
  for (std::size_t e = part.edges.size(); e-- > 0;) {
    const PoseEdge2D& edge = part.graph.edges[e];
    if (edge.kind != PoseEdgeKind::kLoop || pose_edge_chi2(edge, part.graph) <= params_.max_loop_chi2)
      continue;
    const auto at = static_cast<std::ptrdiff_t>(e), in_whole = static_cast<std::ptrdiff_t>(part.edges[e]);
    paths_.remove_loop(graph_.edges[part.edges[e]]);
    graph_.edges.erase(graph_.edges.begin() + in_whole);
    part.graph.edges.erase(part.graph.edges.begin() + at);
    part.edges.erase(part.edges.begin() + at);
    for (std::size_t later = e; later < part.edges.size(); ++later) --part.edges[later];
    ++removed;
  }
  statistics_.removed += removed;
  return removed > 0;
}

SE2 ScanGraph2D::T_map_odom() const {
  if (keyframes_.empty()) return {};
  return graph_.T_map_node.back() * keyframes_.back().T_odom_base.inverse();
}

std::optional<SE2> ScanGraph2D::T_map_base(Time stamp, const SE2& T_odom_base) const {
  if (keyframes_.empty()) return std::nullopt;
  const auto moved_with = [&](std::size_t node) {
    return graph_.T_map_node[node] * (keyframes_[node].T_odom_base.inverse() * T_odom_base);
  };
  const auto after =
      std::ranges::upper_bound(keyframes_, stamp, {}, [](const GraphKeyframe2D& k) { return k.scan.stamp; });
  const auto next = static_cast<std::size_t>(after - keyframes_.begin());
  if (next == 0) return moved_with(0);
  if (next == keyframes_.size()) return moved_with(next - 1);
  const Time before = keyframes_[next - 1].scan.stamp;
  const double fraction = (stamp - before).seconds() / (after->scan.stamp - before).seconds();
  return between(moved_with(next - 1), moved_with(next), fraction);
}

Trajectory ScanGraph2D::corrected(const Trajectory& T_odom_base) const {
  Trajectory result;
  for (const StampedPose& pose : T_odom_base)
    if (const SE2 planar = SE2::from_se3(pose.T_world_base); const auto T = T_map_base(pose.stamp, planar))
      result.push_back({pose.stamp, (*T * planar.inverse()).to_se3() * pose.T_world_base});
  return result;
}

}  // namespace hm
