#pragma once
#include <optional>

#include "hm/slam/laser/graph_keyframes.hpp"
#include "hm/slam/laser/keyframe_registration.hpp"
#include "hm/slam/laser/loop_revision.hpp"
#include "hm/slam/laser/scan_graph_2d.hpp"
#include "hm/slam/pose_graph/graph_part.hpp"

namespace hm {

/// Adds scan odometry to a scan graph and optimises it at intervals, for a vehicle controlled in `odom`;
/// provides the correction `map -> odom` (dissertation 2.4). ScanGraph2D finds the loops. Deterministic; not
/// thread safe.
class LaserLoopCloser {
 public:
  /// Optimises the graph after every `loops_per_solution` new loops (a large graph mostly in part, see
  /// SolutionWindow), as a whole after one that moves it far, and in finish().
  explicit LaserLoopCloser(const ScanGraph2DParams& params = {}, int loops_per_solution = 5)
      : keyframes_(params), graph_(params), loops_per_solution_(loops_per_solution) {}

  /// Adds the odometry result of a scan. Nothing for scans that do not become a node.
  std::optional<ScanGraphStep> add(const PlanarScan& scan, const OdometryStep& step, double height_m = 0);
  /// Adds a keyframe that GraphKeyframes made, instead.
  ScanGraphStep add(const GraphKeyframe2D& keyframe);
  /// Optimises the whole graph, revises its loops (revise_loops), which may take a minute where the map
  /// contradicts itself, and registers its keyframes (register_keyframes); ends early once a stop is
  /// requested. More keyframes can be added after it, which takes the registration back. Returns the
  /// solution of the loops.
  PoseGraphSolution finish(const RunContext& run = {});

  [[nodiscard]] SE2 T_map_odom() const { return graph_.T_map_odom(); }
  [[nodiscard]] const ScanGraph2D& graph() const { return graph_; }
  /// Times the graph was optimised, without those of the revision.
  [[nodiscard]] int solutions() const { return solutions_; }
  /// By the last finish().
  [[nodiscard]] const LoopRevision& revision() const { return revision_; }
  [[nodiscard]] const KeyframeRegistration& registration() const { return registration_; }

 private:
  PoseGraphSolution solve(bool whole);

  GraphKeyframes keyframes_;
  ScanGraph2D graph_;
  int loops_per_solution_;
  int new_loops_ = 0, solutions_ = 0;
  LoopRevision revision_;
  KeyframeRegistration registration_;
  SolutionWindow window_;
};

}  // namespace hm
