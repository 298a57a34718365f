#include "hm/slam/pose_graph/pose_uncertainty_3d.hpp"

#include <Eigen/Cholesky>
#include <functional>
#include <limits>
#include <queue>
#include <utility>

namespace hm {
namespace {

/// Turns a rotation's variance into that of a place this far away, to order paths by one number.
constexpr double kLever_m = 3;

double size_of(const Mat6& covariance) {
  return covariance.topLeftCorner<3, 3>().trace() +
         kLever_m * kLever_m * covariance.bottomRightCorner<3, 3>().trace();
}

using Entry = std::pair<double, std::size_t>;

}  // namespace

std::vector<SeenUncertainty> uncertainties_seen_from(const PoseGraph3D& graph, std::size_t node) {
  const std::size_t count = graph.T_map_node.size();
  std::vector<SeenUncertainty> seen(count);
  std::vector<double> sizes(count, std::numeric_limits<double>::infinity());
  std::vector<std::vector<std::size_t>> edges_of(count);
  for (std::size_t e = 0; e < graph.edges.size(); ++e) {
    edges_of[graph.edges[e].from].push_back(e);
    edges_of[graph.edges[e].to].push_back(e);
  }
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  std::vector<bool> done(count, false);
  seen[node].covariance.setZero();
  seen[node].reached = true;
  sizes[node] = 0;
  open.push({0, node});
  while (!open.empty()) {
    const std::size_t at = open.top().second;
    open.pop();
    if (done[at]) continue;
    done[at] = true;
    for (const std::size_t e : edges_of[at]) {
      const PoseEdge3D& edge = graph.edges[e];
      const bool forward = edge.from == at;
      const std::size_t next = forward ? edge.to : edge.from;
      if (done[next]) continue;
      const Mat6 along = edge.information.llt().solve(Mat6::Identity());
      const Mat6 step = forward ? along : inverse_covariance(edge.T_from_to, along);
      const SE3 T_at_next = forward ? edge.T_from_to : edge.T_from_to.inverse();
      const Mat6 covariance = compose_covariance(seen[at].covariance, T_at_next, step);
      if (!(size_of(covariance) < sizes[next])) continue;
      sizes[next] = size_of(covariance);
      const double way_m = edge.kind == PoseEdgeKind::kOdometry ? edge.T_from_to.translation().norm() : 0;
      seen[next] = {covariance, seen[at].path_m + way_m, true};
      open.push({sizes[next], next});
    }
  }
  return seen;
}

}  // namespace hm
