#pragma once
#include <cstddef>
#include <vector>

#include "hm/geometry/pose_graph_2d.hpp"

namespace hm {

/// Covariance of (x, y, angle) of T_from_to as measured by an edge, x and y along the axes of `from`.
Mat3 edge_covariance(const PoseEdge2D& edge);
/// The information of an edge (axes of `to`) from such a covariance.
Mat3 edge_information(const SE2& T_from_to, const Mat3& covariance);
/// Covariance of the inverse of a pose from that of the pose, each along the axes of its left frame.
Mat3 inverse_covariance(const SE2& T_a_b, const Mat3& covariance_a_b);

/// Upper bounds of the uncertainty of all nodes as seen from one: covariance of T_node_other along the path
/// of least added uncertainty (Dijkstra projection: Olson, "Robust and Efficient Robotic Mapping", 2008,
/// section 4.3). Nodes that no path reaches have infinite variances. O(edges * log(nodes)).
std::vector<Mat3> covariances_seen_from(const PoseGraph2D& graph, std::size_t node);

}  // namespace hm
