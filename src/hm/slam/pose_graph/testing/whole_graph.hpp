#pragma once
#include <algorithm>
#include <numeric>
#include <vector>

#include "hm/slam/pose_graph/path_uncertainty.hpp"

namespace hm::test {

/// PathUncertainty of a complete graph, built node by node.
template <class Geometry>
PathUncertainty<Geometry> paths_of(const typename Geometry::Graph& graph,
                                   std::size_t max_settled = PathUncertainty<Geometry>::kMaxSettled) {
  PathUncertainty<Geometry> paths(max_settled);
  for (std::size_t node = 0; node < graph.T_map_node.size(); ++node) {
    paths.add_node();
    for (const auto& edge : graph.edges)
      if (std::max(edge.from, edge.to) == node) paths.add_edge(edge);
  }
  return paths;
}

template <class Geometry>
std::vector<typename PathUncertainty<Geometry>::Seen> all_seen_from(const typename Geometry::Graph& graph,
                                                                    std::size_t node) {
  std::vector<std::size_t> all(graph.T_map_node.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  return paths_of<Geometry>(graph, all.size()).seen_from(graph, node, all);
}

}  // namespace hm::test
