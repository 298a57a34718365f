#pragma once
#include <cstddef>

#include "hm/geometry/planar_covariance.hpp"
#include "hm/geometry/pose_graph_2d.hpp"
#include "hm/slam/pose_graph/path_uncertainty.hpp"

namespace hm {

/// Covariance of (x, y, angle) of an edge's T_from_to, x and y along the axes of `from`.
Mat3 edge_covariance(const PoseEdge2D& edge);
/// Information matrix of an edge (axes of `to`) from such a covariance.
Mat3 edge_information(const SE2& T_from_to, const Mat3& covariance);
/// Covariance of T_a_b's inverse from that of T_a_b, each along the axes of the transform's left frame.
Mat3 inverse_covariance(const SE2& T_a_b, const Mat3& covariance_a_b);

/// Planar geometry for PathUncertainty: covariances of (x, y, angle), x and y along the axes of the query's
/// node.
struct PlanarPaths {
  using Pose = SE2;
  using Covariance = Mat3;
  using Edge = PoseEdge2D;
  using Graph = PoseGraph2D;
  /// Scalar by which paths are ordered, m^2.
  static double size_of(const Mat3& covariance);
  static bool is_odometry(const PoseEdge2D& edge) { return edge.kind == PoseEdgeKind::kOdometry; }
  static Mat3 edge_covariance(const PoseEdge2D& edge) { return hm::edge_covariance(edge); }
  static double path_m(const PoseEdge2D& edge) {
    return is_odometry(edge) ? edge.T_from_to.translation().norm() : 0;
  }
  static Mat3 inverse(const SE2& T_a_b, const Mat3& covariance) {
    return inverse_covariance(T_a_b, covariance);
  }
  static Mat3 compose(const SE2& T_a_b, const Mat3& covariance_a_b, const SE2& T_b_c,
                      const Mat3& covariance_b_c) {
    return compose_covariance(T_a_b, covariance_a_b, T_b_c, covariance_b_c);
  }
  /// T_a_b in the current graph.
  static SE2 seen_pose(const PoseGraph2D& graph, std::size_t a, std::size_t b) {
    return graph.T_map_node[a].inverse() * graph.T_map_node[b];
  }
};
extern template class PathUncertainty<PlanarPaths>;
using PathUncertainty2D = PathUncertainty<PlanarPaths>;

}  // namespace hm
