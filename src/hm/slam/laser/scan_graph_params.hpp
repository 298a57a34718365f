#pragma once
#include "hm/core/params.hpp"
#include "hm/laser/matching/pl_icp_params.hpp"
#include "hm/slam/pose_graph/pose_graph_2d_solver.hpp"

namespace hm {

/// Parameters of the 2D scan graph. `matcher` and `solver` have names of their own: they are listed apart.
struct ScanGraph2DParams {
  /// A node of the graph when the last one is further away.
  static constexpr double kGraphDistance_m = 0.5;
  /// A node of the graph when turned further from the last one.
  static constexpr double kGraphAngle_rad = 0.52;
  /// Consecutive keyframes that make up a submap.
  static constexpr int kSubmapKeyframes = 10;
  /// Cell of the submaps' likelihood rasters.
  static constexpr double kRasterResolution_m = 0.05;
  /// Spread of the likelihood about a point.
  static constexpr double kRasterSigma_m = 0.06;
  /// Points further away are not used to find loops.
  static constexpr double kMaxPointRange_m = 20;
  /// Points of a scan that the search for loops uses.
  static constexpr int kMaxSearchPoints = 120;
  int min_keyframes_apart = 12;
  /// Submaps that a keyframe is searched in at most; 0: no loops.
  static constexpr int kMaxSubmapsTried = 2;
  /// Submaps further away (beyond the uncertainty) are not tried.
  static constexpr double kMaxLoopDistance_m = 3;
  /// Half the search window in standard deviations.
  static constexpr double kWindowSigmas = 3;
  double max_window_m = 8;
  /// Half the search window at least.
  static constexpr double kMinWindow_m = 0.5;
  /// Half the search window at least.
  static constexpr double kMinWindow_rad = 0.15;
  /// Half the search window at most.
  static constexpr double kMaxWindow_rad = 1.0;
  double min_score = 0.55, ambiguity_ratio = 0.92;
  /// Scans with fewer points close no loops.
  static constexpr int kMinPoints = 40;
  PlIcpParams matcher;
  /// PL-ICP must agree with the search within this.
  static constexpr double kVerifyMaxTranslation_m = 0.25;
  /// PL-ICP must agree with the search within this.
  static constexpr double kVerifyMaxRotation_rad = 0.15;
  /// Share of the points that PL-ICP must pair.
  static constexpr double kVerifyMinPairsRatio = 0.6;
  /// Mean distance from line that PL-ICP may leave.
  static constexpr double kVerifyMaxError_m = 0.06;
  /// Added to every edge: what a matcher does not know of itself.
  static constexpr double kEdgeSigma_m = 0.01;
  /// Added to every edge.
  static constexpr double kEdgeSigma_rad = 0.003;
  /// Factor on the matcher's covariances.
  static constexpr double kEdgeCovarianceScale = 4;
  double max_loop_chi2 = 30;
  PoseGraphSolverParams solver{100, 9};

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"min_keyframes_apart", {1, 100000}, "a loop spans at least so many keyframes"},
      self.min_keyframes_apart);
    v(ParamDoc{"max_window_m", {0, 100}, "half the search window at most"}, self.max_window_m);
    v(ParamDoc{"min_score", {0, 1}, "mean likelihood that a loop needs"}, self.min_score);
    v(ParamDoc{"ambiguity_ratio", {0, 1}, "no loop when another place scores more than this part of it"},
      self.ambiguity_ratio);
    v(ParamDoc{"max_loop_chi2", {0, 1e9}, "loops that disagree more with the solved graph are taken out"},
      self.max_loop_chi2);
  }
};

}  // namespace hm
