#pragma once
#include <cstddef>
#include <vector>

#include "hm/geometry/pose_edge_kind.hpp"
#include "hm/geometry/se3.hpp"

namespace hm {

/// Edge of a 3D pose graph: a measured relative pose of two nodes.
struct PoseEdge3D {
  std::size_t from = 0, to = 0;         ///< indices of nodes
  SE3 T_from_to;                        ///< as measured
  Mat6 information = Mat6::Identity();  ///< of pose_edge_error: m, rad
  PoseEdgeKind kind = PoseEdgeKind::kOdometry;
};

/// 3D pose graph: node poses in the map frame and edges between them.
struct PoseGraph3D {
  std::vector<SE3> T_map_node;
  std::vector<PoseEdge3D> edges;
};

/// Error vector [translation; rotation vector] of T_from_to^-1 * T_map_from^-1 * T_map_to (metres, radians),
/// along the axes of the measured frame `to`. (g2o's EdgeSE3 has half the rotation, as the vector part of a
/// quaternion, with four times the information: the same to second order.)
Vec6 pose_edge_error(const PoseEdge3D& edge, const SE3& T_map_from, const SE3& T_map_to);
/// Squared Mahalanobis error of one edge, error^T information error.
double pose_edge_chi2(const PoseEdge3D& edge, const PoseGraph3D& graph);
/// Sum of pose_edge_chi2 over all edges (no robust kernel).
double pose_graph_chi2(const PoseGraph3D& graph);

/// Applies the perturbation [dt; dw] of pose_edge_error to a pose: T * (exp(dw), dt). The covariances of
/// poses and edges below refer to this perturbation.
SE3 moved_by(const SE3& T, const Vec6& move);

/// Covariance of T_a_c = T_a_b * T_b_c for independent T_a_b and T_b_c, to first order.
Mat6 compose_covariance(const Mat6& covariance_a_b, const SE3& T_b_c, const Mat6& covariance_b_c);
/// Covariance of T_a_b^-1 given that of T_a_b, to first order.
Mat6 inverse_covariance(const SE3& T_a_b, const Mat6& covariance_a_b);

}  // namespace hm
