#pragma once
#include <optional>

#include "hm/laser/odometry/scan_odometry.hpp"
#include "hm/slam/laser/scan_graph_2d.hpp"
#include "hm/slam/pose_graph/graph_part.hpp"

namespace hm {

/// Adds scan odometry to a scan graph and optimises it at intervals, for a vehicle controlled in `odom`;
/// provides the correction `map -> odom`. Deterministic; not thread safe.
class LoopCloser {
 public:
  /// Optimises the graph after every `loops_per_solution` new loops (a large graph mostly in part, see
  /// SolutionWindow), and in finish().
  explicit LoopCloser(const ScanGraph2DParams& params = {}, int loops_per_solution = 5)
      : params_(params), graph_(params), loops_per_solution_(loops_per_solution) {}

  /// Adds the odometry result of a scan. Nothing for scans that do not become a node.
  std::optional<ScanGraphStep> add(const PlanarScan& scan, const OdometryStep& step);
  /// Optimises the whole graph.
  PoseGraphSolution finish();

  [[nodiscard]] SE2 T_map_odom() const { return graph_.T_map_odom(); }
  [[nodiscard]] const ScanGraph2D& graph() const { return graph_; }
  [[nodiscard]] int solutions() const { return solutions_; }

 private:
  PoseGraphSolution solve(bool whole);
  [[nodiscard]] bool wants_node(const SE2& T_odom_base) const;
  [[nodiscard]] Mat3 covariance_since_last(const Mat3& match_odom) const;
  [[nodiscard]] std::optional<Mat3> wheel_covariance_since_last() const;

  ScanGraph2DParams params_;
  ScanGraph2D graph_;
  // Covariances along the axes of `odom`: of the last node's match, and the sum over odometry keyframes since
  // then.
  Mat3 last_match_ = Mat3::Zero(), keyframes_since_ = Mat3::Zero();
  std::optional<Mat3> wheels_since_ = Mat3::Zero();  // of what wheels measured since the last node
  bool unknown_since_ = false;                       // odometry was restarted
  int loops_per_solution_;
  int new_loops_ = 0, solutions_ = 0;
  bool large_correction_ = false;
  SolutionWindow window_;
};

}  // namespace hm
