#pragma once
#include <cstddef>
#include <vector>

#include "hm/geometry/pose_edge_kind.hpp"
#include "hm/geometry/se2.hpp"

namespace hm {

/// Edge of a 2D pose graph: a measured relative pose of two nodes.
struct PoseEdge2D {
  std::size_t from = 0, to = 0;  ///< indices of nodes
  SE2 T_from_to;                 ///< as measured
  Mat3 information =
      Mat3::Identity();  ///< of (x, y, angle), x and y along the axes of pose_edge_error: m, rad
  PoseEdgeKind kind = PoseEdgeKind::kOdometry;
};

/// 2D pose graph: node poses in the map frame and edges between them.
struct PoseGraph2D {
  std::vector<SE2> T_map_node;
  std::vector<PoseEdge2D> edges;
};

/// Error vector (x, y, angle) of T_from_to^-1 * T_map_from^-1 * T_map_to, as in g2o and Kuemmerle et al.
/// (ICRA 2011); metres, radians.
Vec3 pose_edge_error(const PoseEdge2D& edge, const SE2& T_map_from, const SE2& T_map_to);
/// Squared Mahalanobis error of one edge, error^T information error.
double pose_edge_chi2(const PoseEdge2D& edge, const PoseGraph2D& graph);
/// Sum of pose_edge_chi2 over all edges (g2o's chi2; no robust kernel).
double pose_graph_chi2(const PoseGraph2D& graph);

}  // namespace hm
