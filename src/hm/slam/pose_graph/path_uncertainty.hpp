#pragma once
#include <algorithm>
#include <cstddef>
#include <functional>
#include <limits>
#include <queue>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "hm/core/check.hpp"

namespace hm {

/// Upper bounds of the covariance of pose graph nodes relative to one of them, along the path of least added
/// uncertainty (Dijkstra projection: Olson, "Robust and Efficient Robotic Mapping", 2008, section 4.3).
///
/// Grows with its graph, in amortised constant time per node and edge, and stores the edges' covariances. A
/// query ends when its targets are settled, at the latest after `max_settled` nodes. For each unsettled
/// target a second search starts at the target and ends where both meet: where a place has been visited many
/// times, two searches of half the distance settle far fewer nodes than one of the whole distance. It settles
/// at most kMeetingRatio times as many nodes, for all targets of a query together kMeetingsRatio times as
/// many. If they do not meet, the covariance along the chain of odometry edges is used, precomputed for
/// stretches of 1, 2, 4, ... edges (O(log nodes)). So the cost of a query is bounded for any size of the
/// graph, and queries in graphs of up to `max_settled` nodes are exact.
///
/// `Geometry` defines Pose, Covariance, Edge and Graph and the static functions of `PlanarPaths` and
/// `SpatialPaths`. Queries may run in several threads.
template <class Geometry>
class PathUncertainty {
 public:
  using Pose = typename Geometry::Pose;
  using Covariance = typename Geometry::Covariance;
  using Edge = typename Geometry::Edge;
  using Graph = typename Geometry::Graph;

  /// Uncertainty of a node relative to another.
  struct Seen {
    Covariance covariance = Covariance::Zero();  ///< of T_node_other
    double path_m = 0;                           ///< length of the path's odometry edges
    bool reached = false;                        ///< true if there is a path
  };

  static constexpr std::size_t kMaxSettled = 128;
  static constexpr std::size_t kMeetingRatio = 4, kMeetingsRatio = 32;
  static constexpr std::size_t kMostLoops = 16;  ///< number of loops followed from a node, the newest ones
  explicit PathUncertainty(std::size_t max_settled = kMaxSettled) : max_settled_(max_settled) {}

  [[nodiscard]] std::size_t size() const { return steps_from_.size(); }
  void add_node();
  /// Adds an edge. An odometry edge between the two newest nodes continues the chain.
  void add_edge(const Edge& edge);
  /// Removes the loops between the nodes of an edge.
  void remove_loop(const Edge& edge);

  /// Uncertainty of each target relative to `node`, in order. `graph` must contain the added nodes and edges.
  [[nodiscard]] std::vector<Seen> seen_from(const Graph& graph, std::size_t node,
                                            std::span<const std::size_t> targets) const;
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  struct Stretch {
    Pose T_begin_end;
    Covariance covariance = Covariance::Zero();
    double path_m = 0;
  };
  struct Step {
    std::size_t to;
    bool is_odometry;
    Stretch stretch;
  };
  struct State {
    Seen seen;
    double size = 0;
    bool settled = false;
  };
  using States = std::unordered_map<std::size_t, State>;

  static Stretch joined(const Stretch& a, const Stretch& b) {
    return {a.T_begin_end * b.T_begin_end,
            Geometry::compose(a.T_begin_end, a.covariance, b.T_begin_end, b.covariance), a.path_m + b.path_m};
  }
  /// States of a search, and the size up to which all nodes are settled.
  struct Ball {
    States states;
    double radius = 0;
  };

  void connect(const Edge& edge);
  /// Settles nodes in order of uncertainty until `settle(node, state)` returns true.
  template <class Settle>
  States search(const Graph& graph, std::size_t node, Settle settle) const;
  [[nodiscard]] Ball around(const Graph& graph, std::size_t node, std::span<const std::size_t> targets) const;
  [[nodiscard]] State meet(const Graph& graph, std::size_t node, std::size_t target, const Ball& ball,
                           std::size_t& left) const;
  [[nodiscard]] Seen along_chain(std::size_t node, std::size_t target) const;

  std::size_t max_settled_;
  std::vector<std::vector<Step>> steps_from_;
  std::vector<std::size_t> chain_;            ///< first node of the chain that a node belongs to
  std::vector<std::vector<Stretch>> levels_;  ///< [k][i]: from node i 2^k to (i + 1) 2^k
};

template <class Geometry>
void PathUncertainty<Geometry>::add_node() {
  chain_.push_back(size());
  steps_from_.emplace_back();
  if (size() == 1) return;
  // The stretch to the previous node is complete now, and so are the longer ones that end with it.
  for (std::size_t k = 0; k < levels_.size() && levels_[k].size() % 2 == 0; ++k) {
    if (k + 1 == levels_.size()) levels_.emplace_back();
    const std::vector<Stretch>& level = levels_[k];
    levels_[k + 1].push_back(joined(level[level.size() - 2], level.back()));
  }
  if (levels_.empty()) levels_.emplace_back();
  levels_[0].emplace_back();
}

template <class Geometry>
void PathUncertainty<Geometry>::add_edge(const Edge& edge) {
  HM_CHECK(edge.from < size() && edge.to < size(), "edge from {} to {} of {}", edge.from, edge.to, size());
  connect(edge);
  if (!Geometry::is_odometry(edge) || edge.from + 1 != edge.to || edge.to + 1 != size()) return;
  chain_[edge.to] = chain_[edge.from];
  levels_[0].back() = steps_from_[edge.from].back().stretch;
}

template <class Geometry>
void PathUncertainty<Geometry>::connect(const Edge& edge) {
  const Covariance along = Geometry::edge_covariance(edge);
  const double path_m = Geometry::path_m(edge);
  const bool is_odometry = Geometry::is_odometry(edge);
  for (const std::size_t end : {edge.from, edge.to}) {
    std::vector<Step>& steps = steps_from_[end];
    const auto is_loop = [](const Step& step) { return !step.is_odometry; };
    if (is_odometry || static_cast<std::size_t>(std::ranges::count_if(steps, is_loop)) < kMostLoops) continue;
    steps.erase(std::ranges::find_if(steps, is_loop));
  }
  steps_from_[edge.from].push_back({edge.to, is_odometry, {edge.T_from_to, along, path_m}});
  steps_from_[edge.to].push_back(
      {edge.from, is_odometry, {edge.T_from_to.inverse(), Geometry::inverse(edge.T_from_to, along), path_m}});
}

template <class Geometry>
void PathUncertainty<Geometry>::remove_loop(const Edge& edge) {
  const auto remove = [this](std::size_t from, std::size_t to) {
    std::erase_if(steps_from_[from], [to](const Step& step) { return step.to == to && !step.is_odometry; });
  };
  remove(edge.from, edge.to);
  remove(edge.to, edge.from);
}

template <class Geometry>
template <class Settle>
typename PathUncertainty<Geometry>::States PathUncertainty<Geometry>::search(const Graph& graph,
                                                                             std::size_t node,
                                                                             Settle settle) const {
  States states;
  using Entry = std::pair<double, std::size_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  states[node].seen.reached = true;
  open.push({0, node});
  while (!open.empty()) {
    const std::size_t at = open.top().second;
    open.pop();
    State& here = states.at(at);
    if (std::exchange(here.settled, true)) continue;
    if (settle(at, here)) break;
    const Seen seen = here.seen;  // a copy, since insertion may move the table's entries
    const Pose T_node_at = Geometry::seen_pose(graph, node, at);
    for (const Step& step : steps_from_[at]) {
      const auto [next, is_new] = states.try_emplace(step.to);
      if (next->second.settled) continue;
      const Stretch& s = step.stretch;
      const Covariance covariance =
          Geometry::compose(T_node_at, seen.covariance, s.T_begin_end, s.covariance);
      const double size = Geometry::size_of(covariance);
      if (!is_new && !(size < next->second.size)) continue;
      next->second = {{covariance, seen.path_m + s.path_m, true}, size, false};
      open.push({size, step.to});
    }
  }
  return states;
}

template <class Geometry>
typename PathUncertainty<Geometry>::Ball PathUncertainty<Geometry>::around(
    const Graph& graph, std::size_t node, std::span<const std::size_t> targets) const {
  std::vector<std::size_t> wanted(targets.begin(), targets.end());
  std::sort(wanted.begin(), wanted.end());
  wanted.erase(std::unique(wanted.begin(), wanted.end()), wanted.end());
  if (wanted.empty()) return {};
  std::size_t missing = wanted.size(), settled = 0;
  Ball ball;
  ball.states = search(graph, node, [&](std::size_t at, const State& here) {
    ball.radius = here.size;
    missing -= std::binary_search(wanted.begin(), wanted.end(), at) ? 1 : 0;
    return missing == 0 || ++settled >= max_settled_;
  });
  return ball;
}

/// Searches from the target and returns the best connection to the ball. Decreases `left` by the nodes
/// settled.
template <class Geometry>
typename PathUncertainty<Geometry>::State PathUncertainty<Geometry>::meet(
    const Graph& graph, std::size_t node, std::size_t target, const Ball& ball, std::size_t& left) const {
  State best;
  best.size = std::numeric_limits<double>::infinity();
  if (left == 0) return best;
  std::size_t settled = 0;
  search(graph, target, [&](std::size_t at, const State& back) {
    if (const auto met = ball.states.find(at); met != ball.states.end()) {
      const Pose T_target_at = graph.T_map_node[target].inverse() * graph.T_map_node[at];
      const Seen& there = met->second.seen;
      const Covariance covariance =
          Geometry::compose(Geometry::seen_pose(graph, node, at), there.covariance, T_target_at.inverse(),
                            Geometry::inverse(T_target_at, back.seen.covariance));
      if (const double size = Geometry::size_of(covariance); size < best.size)
        best = {{covariance, there.path_m + back.seen.path_m, true}, size, false};
    }
    --left;
    return back.size + ball.radius >= best.size || ++settled >= kMeetingRatio * max_settled_ || left == 0;
  });
  return best;
}

template <class Geometry>
typename PathUncertainty<Geometry>::Seen PathUncertainty<Geometry>::along_chain(std::size_t node,
                                                                                std::size_t target) const {
  if (chain_[node] != chain_[target]) return {};
  const std::size_t begin = std::min(node, target), end = std::max(node, target);
  Stretch whole;
  for (std::size_t at = begin; at < end;) {
    std::size_t k = 0;  // level of the longest stretch that begins here
    while (k + 1 < levels_.size() && at % (std::size_t{2} << k) == 0 && at + (std::size_t{2} << k) <= end &&
           at >> (k + 1) < levels_[k + 1].size())
      ++k;
    whole = joined(whole, levels_[k][at >> k]);
    at += std::size_t{1} << k;
  }
  if (node > target) whole.covariance = Geometry::inverse(whole.T_begin_end, whole.covariance);
  return {whole.covariance, whole.path_m, true};
}

template <class Geometry>
std::vector<typename PathUncertainty<Geometry>::Seen> PathUncertainty<Geometry>::seen_from(
    const Graph& graph, std::size_t node, std::span<const std::size_t> targets) const {
  HM_CHECK(node < size(), "node {} of {}", node, size());
  const Ball ball = around(graph, node, targets);
  std::size_t left = kMeetingsRatio * max_settled_;
  std::vector<Seen> seen;
  for (const std::size_t target : targets) {
    HM_CHECK(target < size(), "target {} of {}", target, size());
    const auto found = ball.states.find(target);
    if (found != ball.states.end() && found->second.settled) {
      seen.push_back(found->second.seen);
      continue;
    }
    const State met = meet(graph, node, target, ball, left);
    const Seen by_chain = along_chain(node, target);
    const bool chain_is_better = by_chain.reached && Geometry::size_of(by_chain.covariance) < met.size;
    seen.push_back(chain_is_better ? by_chain : met.seen);
  }
  return seen;
}

template <class Geometry>
std::size_t PathUncertainty<Geometry>::memory_bytes() const {
  std::size_t bytes = chain_.capacity() * sizeof(std::size_t);
  for (const auto& steps : steps_from_) bytes += sizeof(steps) + steps.capacity() * sizeof(Step);
  for (const auto& level : levels_) bytes += level.capacity() * sizeof(Stretch);
  return bytes;
}

}  // namespace hm
