#pragma once
#include <optional>

#include "hm/laser/odometry/scan_odometry.hpp"
#include "hm/slam/laser/scan_graph_2d.hpp"
#include "hm/slam/pose_graph/graph_part.hpp"

namespace hm {

/// Feeds the keyframes of scan odometry to a scan graph and solves it now and then: `map -> odom` for a
/// vehicle that drives by `odom`. Deterministic; not thread safe.
class LoopCloser {
 public:
  /// The graph is solved as soon as `loops_per_solution` loops are new (a long one mostly in part, see
  /// SolutionWindow), and by finish().
  explicit LoopCloser(const ScanGraph2DParams& params = {}, int loops_per_solution = 5)
      : params_(params), graph_(params), loops_per_solution_(loops_per_solution) {}

  /// Adds the odometry result of a scan. Returns nothing for scans that do not become a node.
  std::optional<ScanGraphStep> add(const PlanarScan& scan, const OdometryStep& step);
  /// Solves the whole graph a last time.
  PoseGraphSolution finish();

  [[nodiscard]] SE2 T_map_odom() const { return graph_.T_map_odom(); }
  [[nodiscard]] const ScanGraph2D& graph() const { return graph_; }
  [[nodiscard]] int solutions() const { return solutions_; }

 private:
  PoseGraphSolution solve(bool whole);
  [[nodiscard]] bool wants_node(const SE2& T_odom_base) const;
  [[nodiscard]] Mat3 covariance_since_last(const Mat3& match_odom) const;

  ScanGraph2DParams params_;
  ScanGraph2D graph_;
  // Along the axes of `odom`: of the last node's match, and of the odometry's keyframes since.
  Mat3 last_match_ = Mat3::Zero(), keyframes_since_ = Mat3::Zero();
  bool unknown_since_ = false;  // odometry was restarted
  int loops_per_solution_;
  int new_loops_ = 0, solutions_ = 0;
  bool large_correction_ = false;
  SolutionWindow window_;
};

}  // namespace hm
