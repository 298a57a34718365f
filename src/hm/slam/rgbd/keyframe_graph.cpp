#include "hm/slam/rgbd/keyframe_graph.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <utility>

#include "hm/core/check.hpp"
#include "hm/slam/pose_graph/graph_part.hpp"

namespace hm {
namespace {

/// Pose of a keyframe to which odometry leads from the one before.
const SE3& T_odom_arrived(const Keyframe& keyframe) {
  return keyframe.end_of_drift ? keyframe.end_of_drift->T_odom_arrived : keyframe.T_odom_camera;
}

}  // namespace

Mat6 odometry_covariance(const SE3& T_last_now, const Mat6& stated, const RgbdLoopParams& params) {
  const double way_m = T_last_now.translation().norm();
  const bool is_known = !stated.isZero(0);
  const double sigma_m = is_known ? params.kOdometryFloor_m + params.kOdometryFloorRatio * way_m
                                  : params.kOdometrySigma_m + params.kOdometryDriftRatio * way_m;
  const double sigma_rad = is_known ? params.kOdometryFloor_rad + params.kOdometryFloor_rad_m * way_m
                                    : params.kOdometrySigma_rad + params.kOdometryDrift_rad_m * way_m;
  Vec6 variances;
  variances << Vec3::Constant(sigma_m * sigma_m), Vec3::Constant(sigma_rad * sigma_rad);
  return stated + Mat6(variances.asDiagonal());
}

std::size_t KeyframeGraph::add(std::shared_ptr<const Keyframe> keyframe) {
  HM_CHECK(keyframe != nullptr);
  const std::size_t node = size();
  paths_.add_node();
  const Keyframe* last = node == 0 ? nullptr : keyframes_.back().get();
  HM_CHECK(last == nullptr || (keyframe->stamp > last->stamp && keyframe->submap >= last->submap),
           "keyframe at {} s, submap {}, after one at {} s, submap {}", keyframe->stamp.seconds(),
           keyframe->submap, last->stamp.seconds(), last->submap);
  HM_CHECK(is_rigid(keyframe->T_odom_camera));
  if (last != nullptr && last->submap == keyframe->submap) {
    const auto& drift = keyframe->end_of_drift;
    PoseEdge3D edge{node - 1, node, last->T_odom_camera.inverse() * T_odom_arrived(*keyframe),
                    Mat6::Identity(), PoseEdgeKind::kOdometry};
    edge.information =
        odometry_covariance(edge.T_from_to, drift ? drift->arrived_covariance : keyframe->motion_covariance,
                            params_)
            .inverse();
    graph_.T_map_node.push_back(graph_.T_map_node.back() * edge.T_from_to);
    graph_.edges.push_back(edge);
    paths_.add_edge(edge);
    map_of_.push_back(map_of_.back());
  } else {
    graph_.T_map_node.push_back(keyframe->T_odom_camera);
    map_of_.push_back(submaps());
    first_of_submap_.push_back(node);
  }
  keyframes_.push_back(std::move(keyframe));
  if (const auto& drift = keyframes_.back()->end_of_drift) add_end_of_drift(*drift);
  return node;
}

/// Edge between the last keyframe and the one whose landmarks have found it.
void KeyframeGraph::add_end_of_drift(const EndOfDrift& end) {
  const auto known = std::ranges::lower_bound(keyframes_, end.known_frame, {},
                                              [](const auto& keyframe) { return keyframe->frame_index; });
  const Keyframe& now = *keyframes_.back();
  if (known + 1 >= keyframes_.end() || (*known)->frame_index != end.known_frame ||
      (*known)->submap != now.submap)
    return;
  add_loop({static_cast<std::size_t>(known - keyframes_.begin()), size() - 1, end.T_known_camera,
            odometry_covariance(end.T_known_camera, now.motion_covariance, params_).inverse(),
            PoseEdgeKind::kLoop});
}

void KeyframeGraph::add_loop(const PoseEdge3D& edge) {
  HM_CHECK(edge.from < size() && edge.to < size() && edge.from != edge.to, "loop from {} to {} of {}",
           edge.from, edge.to, size());
  const int from = map_of_[edge.from], to = map_of_[edge.to];
  if (from != to) {
    const bool moves_to = to > from;
    const SE3 T_map_to = graph_.T_map_node[edge.from] * edge.T_from_to;
    const SE3 T_map_from = graph_.T_map_node[edge.to] * edge.T_from_to.inverse();
    const SE3 move = moves_to ? T_map_to * graph_.T_map_node[edge.to].inverse()
                              : T_map_from * graph_.T_map_node[edge.from].inverse();
    const int moved = moves_to ? to : from;
    for (std::size_t i = 0; i < size(); ++i) {
      if (map_of_[i] != moved) continue;
      graph_.T_map_node[i] = move * graph_.T_map_node[i];
      map_of_[i] = moves_to ? from : to;
    }
  }
  graph_.edges.push_back(edge);
  paths_.add_edge(edge);
}

KeyframeGraphSolution KeyframeGraph::solve(std::size_t first) {
  GraphPart<PoseGraph3D> part = part_since(graph_, first);
  ContradictionResult result =
      solve_without_contradictions(part.graph, params_.kMaxLoopChi2, params_.solver, part.held);
  put_back(part, graph_);
  KeyframeGraphSolution solution{std::move(result.solution), {}};
  for (auto taken = result.removed.rbegin(); taken != result.removed.rend(); ++taken) {
    const auto edge = graph_.edges.begin() + static_cast<std::ptrdiff_t>(part.edges[*taken]);
    solution.removed.push_back(*edge);
    paths_.remove_loop(*edge);
    graph_.edges.erase(edge);
  }
  return solution;
}

void KeyframeGraph::set_poses(std::vector<SE3> T_map_node) {
  HM_CHECK(T_map_node.size() == size(), "{} poses for {} keyframes", T_map_node.size(), size());
  graph_.T_map_node = std::move(T_map_node);
}

std::vector<SeenUncertainty> KeyframeGraph::uncertainties_seen_from(
    std::size_t node, std::span<const std::size_t> nodes) const {
  std::vector<std::size_t> of_map;
  for (const std::size_t other : nodes)
    if (map_of(other) == map_of(node)) of_map.push_back(other);
  const std::vector<SeenUncertainty> found = paths_.seen_from(graph_, node, of_map);
  std::vector<SeenUncertainty> seen;
  std::size_t next = 0;
  for (const std::size_t other : nodes)
    seen.push_back(map_of(other) == map_of(node) ? found[next++] : SeenUncertainty{});
  return seen;
}

std::vector<std::size_t> KeyframeGraph::first_nodes() const {
  std::vector<std::size_t> first;
  for (std::size_t submap = 0; submap < first_of_submap_.size(); ++submap)
    if (map_of_[first_of_submap_[submap]] == static_cast<int>(submap))
      first.push_back(first_of_submap_[submap]);
  return first;
}

SE3 KeyframeGraph::T_map_odom() const {
  if (size() == 0) return {};
  return graph_.T_map_node.back() * keyframes_.back()->T_odom_camera.inverse();
}

CorrectedKeyframes KeyframeGraph::corrected() const {
  std::vector<CorrectedKeyframe> corrected;
  corrected.reserve(size());
  for (std::size_t i = 0; i < size(); ++i) {
    const Keyframe& keyframe = *keyframes_[i];
    corrected.push_back({keyframe.frame_index,
                         keyframe.stamp,
                         keyframe.submap,
                         map_of_[i],
                         keyframe.T_odom_camera,
                         graph_.T_map_node[i],
                         {}});
    if (const auto& drift = keyframe.end_of_drift) corrected.back().T_odom_arrived = drift->T_odom_arrived;
  }
  return CorrectedKeyframes(std::move(corrected));
}

}  // namespace hm
