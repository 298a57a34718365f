#include "hm/geometry/pose_graph_2d.hpp"

namespace hm {

Vec3 pose_edge_error(const PoseEdge2D& edge, const SE2& T_map_from, const SE2& T_map_to) {
  return (edge.T_from_to.inverse() * (T_map_from.inverse() * T_map_to)).vector();
}

double pose_edge_chi2(const PoseEdge2D& edge, const PoseGraph2D& graph) {
  const Vec3 error = pose_edge_error(edge, graph.T_map_node[edge.from], graph.T_map_node[edge.to]);
  return error.dot(edge.information * error);
}

double pose_graph_chi2(const PoseGraph2D& graph) {
  double sum = 0;
  for (const PoseEdge2D& edge : graph.edges) sum += pose_edge_chi2(edge, graph);
  return sum;
}

}  // namespace hm
