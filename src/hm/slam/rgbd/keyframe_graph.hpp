#pragma once
#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "hm/geometry/pose_graph_3d.hpp"
#include "hm/odometry/feature/keyframe.hpp"
#include "hm/slam/pose_graph/pose_graph_3d_solver.hpp"
#include "hm/slam/pose_graph/pose_uncertainty_3d.hpp"
#include "hm/slam/rgbd/corrected_keyframes.hpp"
#include "hm/slam/rgbd/rgbd_loop_params.hpp"

namespace hm {

/// A solution, and the loops that it has taken out.
struct KeyframeGraphSolution {
  PoseGraphSolution solution;
  std::vector<PoseEdge3D> removed;
};

/// The keyframes of a recording as a pose graph: odometry between those of a submap, loops between any, and
/// which submaps hang together.
class KeyframeGraph {
 public:
  explicit KeyframeGraph(const RgbdLoopParams& params) : params_(params) {}

  /// Adds a keyframe where odometry puts it; returns its node. One that ends a drift stays where the drift
  /// leads, until the graph is solved with its edge to the keyframe that it was found by.
  std::size_t add(std::shared_ptr<const Keyframe> keyframe);
  /// Adds a loop. Between two maps: the younger map is moved as a whole to where the loop puts it, and they
  /// become one.
  void add_loop(const PoseEdge3D& edge);

  /// Solves the graph, or its part from node `first` on; loops that contradict the rest are taken out of it.
  KeyframeGraphSolution solve(std::size_t first = 0);
  /// Poses of all nodes that something else has found.
  void set_poses(std::vector<SE3> T_map_node);

  [[nodiscard]] std::size_t size() const { return keyframes_.size(); }
  [[nodiscard]] const Keyframe& keyframe(std::size_t node) const { return *keyframes_[node]; }
  [[nodiscard]] const std::vector<std::shared_ptr<const Keyframe>>& keyframes() const { return keyframes_; }
  /// The map that a node belongs to: the number of the oldest submap in it, as they came.
  [[nodiscard]] int map_of(std::size_t node) const { return map_of_[node]; }
  /// The first nodes of all maps.
  [[nodiscard]] std::vector<std::size_t> first_nodes() const;
  [[nodiscard]] const PoseGraph3D& graph() const { return graph_; }
  /// How uncertain nodes are as seen from one of them; nodes of other maps are not reached. The time does not
  /// grow with the graph (PathUncertainty).
  [[nodiscard]] std::vector<SeenUncertainty> uncertainties_seen_from(
      std::size_t node, std::span<const std::size_t> nodes) const;
  [[nodiscard]] int submaps() const { return static_cast<int>(first_of_submap_.size()); }
  [[nodiscard]] CorrectedKeyframes corrected() const;
  /// CorrectedKeyframes::T_map_odom of it.
  [[nodiscard]] SE3 T_map_odom() const;

 private:
  void add_end_of_drift(const EndOfDrift& end);
  RgbdLoopParams params_;
  std::vector<std::shared_ptr<const Keyframe>> keyframes_;
  std::vector<int> map_of_;
  std::vector<std::size_t> first_of_submap_;
  PoseGraph3D graph_;
  PathUncertainty3D paths_;
};

/// Covariance of odometry's move from a keyframe to another one: the stated one (Keyframe::motion_covariance)
/// with a share of the way for errors it does not model; a larger share where none is stated (zero).
Mat6 odometry_covariance(const SE3& T_last_now, const Mat6& stated, const RgbdLoopParams& params);

}  // namespace hm
