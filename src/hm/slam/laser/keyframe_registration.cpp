#include "hm/slam/laser/keyframe_registration.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "hm/core/parallel.hpp"
#include "hm/core/statistics.hpp"
#include "hm/slam/laser/loop_revision.hpp"
#include "hm/slam/laser/scan_visits.hpp"

namespace hm {
namespace {

constexpr int kRounds = 2;
constexpr std::size_t kMostNeighbours = 12;
/// Beyond it two scans share little, from a doorway to the next room's.
constexpr double kReach_m = 8;
/// The keyframe before has been matched by odometry.
constexpr std::size_t kNeighbourApart = 2;
/// A turn counts in the median of so many keyframes on each side of one and its own: single ones among chairs
/// are turned for themselves.
constexpr std::size_t kTurnedAlike = 2;
/// Keyframes between two looks at the stop token; and those of one task of a thread.
constexpr std::size_t kBlock = 256, kGrain = 16;

/// The nearest earlier keyframes of a node, by apart_m().
std::vector<std::size_t> earlier_neighbours(const ScanGraph2D& graph, std::size_t node) {
  const std::vector<SE2>& T_map = graph.graph().T_map_node;
  std::vector<std::pair<double, std::size_t>> near;
  for (std::size_t k = 0; k + kNeighbourApart <= node; ++k) {
    if ((T_map[k].translation() - T_map[node].translation()).squaredNorm() > kReach_m * kReach_m) continue;
    if (std::abs(graph.keyframe(k).height_m - graph.keyframe(node).height_m) > ScanVisits::kSameHeight_m)
      continue;
    near.emplace_back(apart_m(T_map[k].inverse() * T_map[node]), k);
  }
  const auto end = near.begin() + static_cast<std::ptrdiff_t>(std::min(near.size(), kMostNeighbours));
  std::partial_sort(near.begin(), end, near.end());
  std::vector<std::size_t> nodes;
  for (auto neighbour = near.begin(); neighbour != end; ++neighbour) nodes.push_back(neighbour->second);
  return nodes;
}

/// What matching found for one keyframe.
struct Matched {
  std::size_t pairs = 0;
  std::vector<PoseEdge2D> edges;
};

/// The earlier scan is the reference: a laser that looks ahead saw from there what the later scan shows, but
/// not the other way round (half as many matches are confirmed then).
Matched match_neighbours(const ScanGraph2D& graph, std::size_t node, PlIcp& matcher) {
  const std::vector<SE2>& T_map = graph.graph().T_map_node;
  Matched result;
  for (const std::size_t k : earlier_neighbours(graph, node)) {
    const SE2 guess = T_map[k].inverse() * T_map[node];
    const ScanMatch match = matcher.match(graph.keyframe(k).scan, graph.keyframe(node).scan, guess);
    ++result.pairs;
    if (match.ok() && confirms_shared(match, guess, graph.params()))
      result.edges.push_back(graph.loop_edge(node, {k, *match.T_reference_sensed, match.covariance}));
  }
  return result;
}

/// The matches of all keyframes with their neighbours; nothing once a stop is requested.
std::optional<Matched> match_all(const ScanGraph2D& graph, std::size_t done, const RunContext& run) {
  const ParallelLoop loop(run.threads);
  const std::size_t size = graph.size();
  std::vector<Matched> of_node(size);
  for (std::size_t first = 0; first < size; first += kBlock) {
    if (run.stop.stop_requested()) return std::nullopt;
    if (run.progress) run.progress({"registering keyframes", done + first, kRounds * size, {}});
    loop.for_ranges(std::min(kBlock, size - first), kGrain, [&](std::size_t begin, std::size_t end) {
      PlIcp matcher(graph.params().matcher);
      for (std::size_t i = first + begin; i < first + end; ++i)
        of_node[i] = match_neighbours(graph, i, matcher);
    });
  }
  Matched all;
  for (const Matched& one : of_node) {
    all.pairs += one.pairs;
    all.edges.insert(all.edges.end(), one.edges.begin(), one.edges.end());
  }
  return all;
}

/// For each step from a keyframe to the next, whether no loop spans it.
std::vector<bool> unspanned_steps(const PoseGraph2D& graph) {
  std::vector<int> begun(graph.T_map_node.size(), 0);  // loops that begin here, less those that end
  for (const PoseEdge2D& edge : graph.edges) {
    if (edge.kind != PoseEdgeKind::kLoop) continue;
    ++begun[std::min(edge.from, edge.to)];
    --begun[std::max(edge.from, edge.to)];
  }
  std::vector<bool> unspanned(begun.size());
  int spanning = 0;
  for (std::size_t i = 0; i < begun.size(); ++i) unspanned[i] = (spanning += begun[i]) == 0;
  return unspanned;
}

/// By how much each keyframe was turned, as the median of its neighbours.
std::vector<double> turned_rad(const std::vector<SE2>& before, const std::vector<SE2>& after) {
  std::vector<double> each(before.size()), medians;
  for (std::size_t i = 0; i < each.size(); ++i) each[i] = (before[i].inverse() * after[i]).angle();
  for (std::size_t i = 0; i < each.size(); ++i) {
    std::vector<double> near(
        each.begin() + static_cast<std::ptrdiff_t>(i - std::min(i, kTurnedAlike)),
        each.begin() + static_cast<std::ptrdiff_t>(std::min(i + kTurnedAlike + 1, each.size())));
    medians.push_back(middle_value(std::span(near)));
  }
  return medians;
}

UncheckedTurn unchecked_turn(const ScanGraph2D& graph, const PoseGraph2D& before,
                             const std::vector<SE2>& after) {
  const std::vector<bool> unspanned = unspanned_steps(before);
  const std::vector<double> turned = turned_rad(before.T_map_node, after);
  UncheckedTurn most;
  for (std::size_t i = 1, first = 0; i < turned.size(); ++i) {
    if (!unspanned[i - 1]) first = i;
    const double angle_rad = std::abs(wrap_angle(turned[i] - turned[first]));
    if (angle_rad > most.angle_rad)
      most = {angle_rad, graph.keyframe(first).scan.stamp, graph.keyframe(i).scan.stamp};
  }
  return most;
}

}  // namespace

KeyframeRegistration register_keyframes(ScanGraph2D& graph, const RunContext& run) {
  KeyframeRegistration result;
  const ScanGraph2D::State before = graph.state();
  ScanGraph2D::State state = before;
  const auto contradicted = [&] { return graph_agreement(graph).contradicted.size(); };
  for (int round = 0; round < kRounds; ++round) {
    const auto matched = match_all(graph, static_cast<std::size_t>(round) * graph.size(), run);
    if (!matched) break;
    PoseGraph2D joint = state.graph;
    joint.edges.insert(joint.edges.end(), matched->edges.begin(), matched->edges.end());
    if (!solve_pose_graph(joint, graph.params().solver).converged) break;
    result.pairs = matched->pairs;
    result.registered = matched->edges.size();
    state.graph.T_map_node = std::move(joint.T_map_node);
    graph.restore(state);
  }
  result.unchecked = unchecked_turn(graph, before.graph, state.graph.T_map_node);
  if (const std::size_t now = contradicted(); now > 0) {
    graph.restore(before);
    if (now > contradicted()) return {result.pairs, 0, 0, result.unchecked};
    graph.restore(state);
  }
  for (std::size_t i = 0; i < graph.size(); ++i)
    result.moved_m =
        std::max(result.moved_m,
                 (state.graph.T_map_node[i].translation() - before.graph.T_map_node[i].translation()).norm());
  return result;
}

}  // namespace hm
