#pragma once
#include <cstddef>
#include <vector>

#include "hm/geometry/pose_graph_3d.hpp"

namespace hm {

/// How uncertain a node is as seen from another.
struct SeenUncertainty {
  Mat6 covariance;       ///< of the move (moved_by) of T_node_other along the best path
  double path_m = 0;     ///< length of that path's odometry edges
  bool reached = false;  ///< a path leads there
};

/// Upper bounds of the uncertainty of all nodes as seen from one, along the path of least added uncertainty
/// (Dijkstra projection: Olson, "Robust and Efficient Robotic Mapping", 2008, section 4.3).
/// O(edges * log(nodes)).
std::vector<SeenUncertainty> uncertainties_seen_from(const PoseGraph3D& graph, std::size_t node);

}  // namespace hm
