#pragma once
#include <algorithm>
#include <cstddef>
#include <functional>
#include <queue>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "hm/core/check.hpp"

namespace hm {

/// Upper bounds of the uncertainty of nodes of a pose graph as seen from one of them, along the path of least
/// added uncertainty (Dijkstra projection: Olson, "Robust and Efficient Robotic Mapping", 2008, section 4.3).
///
/// Grows with its graph, a node or an edge in amortised constant time, and holds the covariances of its
/// edges. A query ends when its targets are settled, at the latest after `max_settled` nodes; targets beyond
/// are seen along the chain of odometry edges, whose motions are kept composed over stretches of 1, 2, 4, ...
/// edges (O(log nodes)), or as far as the search has come, whichever is less uncertain. So the cost of a
/// query is bounded however large the graph is, and queries in graphs of up to `max_settled` nodes are exact.
///
/// `Geometry` names Pose, Covariance, Edge and Graph and has the static functions that `PlanarPaths` and
/// `SpatialPaths` have. Queries may run in several threads.
template <class Geometry>
class PathUncertainty {
 public:
  using Pose = typename Geometry::Pose;
  using Covariance = typename Geometry::Covariance;
  using Edge = typename Geometry::Edge;
  using Graph = typename Geometry::Graph;

  /// How uncertain a node is as seen from another.
  struct Seen {
    Covariance covariance = Covariance::Zero();  ///< of T_node_other
    double path_m = 0;                           ///< length of the path's odometry edges
    bool reached = false;                        ///< a path leads there
  };

  static constexpr std::size_t kMaxSettled = 4096;
  explicit PathUncertainty(std::size_t max_settled = kMaxSettled) : max_settled_(max_settled) {}

  [[nodiscard]] std::size_t size() const { return steps_from_.size(); }
  void add_node();
  /// An odometry edge to the newest node from the one before continues the chain.
  void add_edge(const Edge& edge);
  /// When loops were taken out: the edges that are left.
  void replace_edges(std::span<const Edge> edges);

  /// One for each target, in their order. `graph` is that of the nodes and edges that were added.
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
  void connect(const Edge& edge);
  [[nodiscard]] States search(const Graph& graph, std::size_t node,
                              std::span<const std::size_t> targets) const;
  [[nodiscard]] Seen along_chain(std::size_t node, std::size_t target) const;

  std::size_t max_settled_;
  std::vector<std::vector<Step>> steps_from_;
  std::vector<std::size_t> chain_;            ///< the first node of the chain that a node belongs to
  std::vector<std::vector<Stretch>> levels_;  ///< [k][i]: from node i 2^k to (i + 1) 2^k
};

template <class Geometry>
void PathUncertainty<Geometry>::add_node() {
  chain_.push_back(size());
  steps_from_.emplace_back();
  if (size() == 1) return;
  // The stretch to the node before is complete now, and those that end with it.
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
  steps_from_[edge.from].push_back({edge.to, {edge.T_from_to, along, path_m}});
  steps_from_[edge.to].push_back(
      {edge.from, {edge.T_from_to.inverse(), Geometry::inverse(edge.T_from_to, along), path_m}});
}

template <class Geometry>
void PathUncertainty<Geometry>::replace_edges(std::span<const Edge> edges) {
  for (std::vector<Step>& steps : steps_from_) steps.clear();
  for (const Edge& edge : edges) connect(edge);
}

template <class Geometry>
typename PathUncertainty<Geometry>::States PathUncertainty<Geometry>::search(
    const Graph& graph, std::size_t node, std::span<const std::size_t> targets) const {
  States states;
  std::vector<std::size_t> wanted(targets.begin(), targets.end());
  std::sort(wanted.begin(), wanted.end());
  wanted.erase(std::unique(wanted.begin(), wanted.end()), wanted.end());
  std::size_t missing = wanted.size();
  using Entry = std::pair<double, std::size_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  states[node].seen.reached = true;
  open.push({0, node});
  for (std::size_t settled = 0; !open.empty() && missing > 0 && settled < max_settled_;) {
    const std::size_t at = open.top().second;
    open.pop();
    State& here = states.at(at);
    if (std::exchange(here.settled, true)) continue;
    ++settled;
    missing -= std::binary_search(wanted.begin(), wanted.end(), at) ? 1 : 0;
    const Seen seen = here.seen;  // inserting below may move what is in the table
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
typename PathUncertainty<Geometry>::Seen PathUncertainty<Geometry>::along_chain(std::size_t node,
                                                                                std::size_t target) const {
  if (chain_[node] != chain_[target]) return {};
  const std::size_t begin = std::min(node, target), end = std::max(node, target);
  Stretch whole;
  for (std::size_t at = begin; at < end;) {
    std::size_t k = 0;  // the longest stretch that begins here
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
  const States states = search(graph, node, targets);
  std::vector<Seen> seen;
  for (const std::size_t target : targets) {
    HM_CHECK(target < size(), "target {} of {}", target, size());
    const auto found = states.find(target);
    const bool is_found = found != states.end();
    if (is_found && found->second.settled) {
      seen.push_back(found->second.seen);
      continue;
    }
    const Seen by_chain = along_chain(node, target);
    const bool chain_is_better =
        by_chain.reached && (!is_found || Geometry::size_of(by_chain.covariance) < found->second.size);
    seen.push_back(chain_is_better || !is_found ? by_chain : found->second.seen);
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
