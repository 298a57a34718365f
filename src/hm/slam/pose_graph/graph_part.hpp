#pragma once
#include <algorithm>
#include <cstddef>
#include <vector>

#include "hm/geometry/pose_edge_kind.hpp"

namespace hm {

/// Newest part of a growing pose graph, to be optimised alone at bounded cost: the newest nodes, all edges at
/// them, and the older nodes at the other ends of these edges, which are fixed.
template <class Graph>
struct GraphPart {
  Graph graph;                     ///< fixed nodes first
  std::size_t held = 0;            ///< number of fixed nodes (at least one)
  std::vector<std::size_t> nodes;  ///< indices in the whole graph
  std::vector<std::size_t> edges;  ///< likewise
};

/// Returns the part from node `first` on (0: the whole graph). Edges must be in order of insertion: no edge
/// before an odometry edge refers to a newer node than that edge does. The cost depends on the part's edges
/// only.
template <class Graph>
GraphPart<Graph> part_since(const Graph& graph, std::size_t first) {
  GraphPart<Graph> part;
  for (std::size_t e = graph.edges.size(); e-- > 0;) {
    const auto& edge = graph.edges[e];
    if (std::max(edge.from, edge.to) >= first) {
      part.edges.push_back(e);
      if (std::min(edge.from, edge.to) < first) part.nodes.push_back(std::min(edge.from, edge.to));
    } else if (edge.kind == PoseEdgeKind::kOdometry) {
      break;
    }
  }
  std::ranges::reverse(part.edges);
  std::ranges::sort(part.nodes);
  part.nodes.erase(std::unique(part.nodes.begin(), part.nodes.end()), part.nodes.end());
  part.held = part.nodes.size();
  for (std::size_t node = first; node < graph.T_map_node.size(); ++node) part.nodes.push_back(node);
  for (const std::size_t node : part.nodes) part.graph.T_map_node.push_back(graph.T_map_node[node]);
  const auto number_of = [&](std::size_t node) {
    return static_cast<std::size_t>(std::ranges::lower_bound(part.nodes, node) - part.nodes.begin());
  };
  for (const std::size_t e : part.edges) {
    auto edge = graph.edges[e];
    edge.from = number_of(edge.from);
    edge.to = number_of(edge.to);
    part.graph.edges.push_back(edge);
  }
  part.held = std::max<std::size_t>(1, part.held);
  return part;
}

/// Copies the poses of a part to the whole graph.
template <class Graph>
void put_back(const GraphPart<Graph>& part, Graph& graph) {
  for (std::size_t i = 0; i < part.nodes.size(); ++i)
    graph.T_map_node[part.nodes[i]] = part.graph.T_map_node[i];
}

/// Selects the part of a growing graph to optimise: the newest kNewest nodes, and the whole graph whenever it
/// has grown by a tenth since its last full optimisation, so that their total cost per keyframe is bounded.
/// Graphs of up to kNewest nodes are always optimised as a whole.
class SolutionWindow {
 public:
  static constexpr std::size_t kNewest = 1000, kWholeEvery = 10;

  /// Index of the first node to optimise, 0 for all; `whole` requests all (large correction, end of a run).
  std::size_t next(std::size_t nodes, bool whole) {
    if (!whole && nodes > kNewest && kWholeEvery * (nodes - last_whole_) < nodes) return nodes - kNewest;
    last_whole_ = nodes;
    return 0;
  }

 private:
  std::size_t last_whole_ = 0;
};

}  // namespace hm
