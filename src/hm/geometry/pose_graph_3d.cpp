#include "hm/geometry/pose_graph_3d.hpp"

namespace hm {
namespace {

/// Jacobian of the perturbation of T * T_b_c with respect to that of T, for perturbations as in moved_by().
Mat6 carried_through(const SE3& T_b_c) {
  const Mat3 turn = T_b_c.rotation().transpose();
  Mat6 carry = Mat6::Zero();
  carry.topLeftCorner<3, 3>() = turn;
  carry.topRightCorner<3, 3>() = -turn * skew(T_b_c.translation());
  carry.bottomRightCorner<3, 3>() = turn;
  return carry;
}

}  // namespace

Vec6 pose_edge_error(const PoseEdge3D& edge, const SE3& T_map_from, const SE3& T_map_to) {
  const SE3 beyond = edge.T_from_to.inverse() * (T_map_from.inverse() * T_map_to);
  Vec6 error;
  error << beyond.translation(), so3_log(beyond.rotation());
  return error;
}

double pose_edge_chi2(const PoseEdge3D& edge, const PoseGraph3D& graph) {
  const Vec6 error = pose_edge_error(edge, graph.T_map_node[edge.from], graph.T_map_node[edge.to]);
  return error.dot(edge.information * error);
}

double pose_graph_chi2(const PoseGraph3D& graph) {
  double sum = 0;
  for (const PoseEdge3D& edge : graph.edges) sum += pose_edge_chi2(edge, graph);
  return sum;
}

SE3 moved_by(const SE3& T, const Vec6& move) { return T * SE3(so3_exp(move.tail<3>()), move.head<3>()); }

Mat6 compose_covariance(const Mat6& covariance_a_b, const SE3& T_b_c, const Mat6& covariance_b_c) {
  const Mat6 carry = carried_through(T_b_c);
  return carry * covariance_a_b * carry.transpose() + covariance_b_c;
}

Mat6 inverse_covariance(const SE3& T_a_b, const Mat6& covariance_a_b) {
  // (T M)^-1 = T^-1 (T M^-1 T^-1): the perturbation of the inverse is the negative perturbation, carried
  // through T^-1.
  const Mat6 carry = carried_through(T_a_b.inverse());
  return carry * covariance_a_b * carry.transpose();
}

}  // namespace hm
