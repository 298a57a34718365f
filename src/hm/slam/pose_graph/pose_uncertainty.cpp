#include "hm/slam/pose_graph/pose_uncertainty.hpp"

#include <Eigen/LU>
#include <functional>
#include <limits>
#include <queue>
#include <utility>

namespace hm {
namespace {

/// Turns an angle's variance into that of a place this far away, to order paths by one number.
constexpr double kPlanarLever_m = 5;

double size_of(const Mat3& covariance) {
  return covariance(0, 0) + covariance(1, 1) + kPlanarLever_m * kPlanarLever_m * covariance(2, 2);
}

Mat3 turned(const Mat2& rotation, const Mat3& covariance) {
  Mat3 turn = Mat3::Identity();
  turn.topLeftCorner<2, 2>() = rotation;
  return turn * covariance * turn.transpose();
}

}  // namespace

Mat3 edge_covariance(const PoseEdge2D& edge) {
  return turned(edge.T_from_to.rotation(), edge.information.inverse());
}

Mat3 edge_information(const SE2& T_from_to, const Mat3& covariance) {
  return turned(T_from_to.rotation().transpose(), covariance).inverse();
}

Mat3 inverse_covariance(const SE2& T_a_b, const Mat3& covariance_a_b) {
  const SE2 T_b_a = T_a_b.inverse();
  Mat3 jacobian = -Mat3::Identity();
  jacobian.topLeftCorner<2, 2>() = -T_b_a.rotation();
  jacobian(0, 2) = T_b_a.y();
  jacobian(1, 2) = -T_b_a.x();
  return jacobian * covariance_a_b * jacobian.transpose();
}

std::vector<Mat3> covariances_seen_from(const PoseGraph2D& graph, std::size_t node) {
  const std::size_t count = graph.T_map_node.size();
  const double infinite = std::numeric_limits<double>::infinity();
  std::vector<Mat3> covariances(count, Mat3(Vec3::Constant(infinite).asDiagonal()));
  std::vector<std::vector<std::size_t>> edges_of(count);
  for (std::size_t e = 0; e < graph.edges.size(); ++e) {
    edges_of[graph.edges[e].from].push_back(e);
    edges_of[graph.edges[e].to].push_back(e);
  }
  using Entry = std::pair<double, std::size_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  std::vector<bool> done(count, false);
  covariances[node].setZero();
  open.push({0, node});
  while (!open.empty()) {
    const std::size_t at = open.top().second;
    open.pop();
    if (done[at]) continue;
    done[at] = true;
    const SE2 T_node_at = graph.T_map_node[node].inverse() * graph.T_map_node[at];
    for (const std::size_t e : edges_of[at]) {
      const PoseEdge2D& edge = graph.edges[e];
      const bool forward = edge.from == at;
      const std::size_t next = forward ? edge.to : edge.from;
      if (done[next]) continue;
      const Mat3 along = edge_covariance(edge);
      const Mat3 covariance =
          compose_covariance(T_node_at, covariances[at], forward ? edge.T_from_to : edge.T_from_to.inverse(),
                             forward ? along : inverse_covariance(edge.T_from_to, along));
      if (!(size_of(covariance) < size_of(covariances[next]))) continue;
      covariances[next] = covariance;
      open.push({size_of(covariance), next});
    }
  }
  return covariances;
}

}  // namespace hm
