#pragma once
#include <cstddef>
#include <vector>

#include "hm/geometry/pose_edge_kind.hpp"
#include "hm/geometry/se3.hpp"

namespace hm {

/// A measured motion between two poses of a graph.
struct PoseEdge3D {
  std::size_t from = 0, to = 0;         ///< indices of nodes
  SE3 T_from_to;                        ///< as measured
  Mat6 information = Mat6::Identity();  ///< of pose_edge_error: m, rad
  PoseEdgeKind kind = PoseEdgeKind::kOdometry;
};

/// Poses in space and measured motions between them.
struct PoseGraph3D {
  std::vector<SE3> T_map_node;
  std::vector<PoseEdge3D> edges;
};

/// [translation; rotation vector] of T_from_to^-1 * T_map_from^-1 * T_map_to: what the true pose of `to` is
/// beyond the measured one, along the axes of the measured `to`. (g2o's EdgeSE3 has half the rotation, as the
/// vector part of a quaternion, with four times the information: the same to second order.)
Vec6 pose_edge_error(const PoseEdge3D& edge, const SE3& T_map_from, const SE3& T_map_to);
/// error^T information error.
double pose_edge_chi2(const PoseEdge3D& edge, const PoseGraph3D& graph);
/// The sum over all edges (no robust kernel).
double pose_graph_chi2(const PoseGraph3D& graph);

/// A pose moved by [dt; dw] as in pose_edge_error: T * (exp(dw), dt). Covariances of poses and edges below
/// are of such a move.
SE3 moved_by(const SE3& T, const Vec6& move);

/// Covariance of T_a_c = T_a_b * T_b_c from those of independent T_a_b and T_b_c; first order.
Mat6 compose_covariance(const Mat6& covariance_a_b, const SE3& T_b_c, const Mat6& covariance_b_c);
/// Covariance of T_a_b^-1 from that of T_a_b; first order.
Mat6 inverse_covariance(const SE3& T_a_b, const Mat6& covariance_a_b);

}  // namespace hm
