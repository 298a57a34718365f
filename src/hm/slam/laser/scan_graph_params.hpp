#pragma once
#include "hm/core/params.hpp"
#include "hm/laser/matching/pl_icp_params.hpp"
#include "hm/slam/pose_graph/pose_graph_2d_solver.hpp"

namespace hm {

/// Parameters of the 2D scan graph. `matcher` and `solver` have their own sections.
struct ScanGraph2DParams {
  /// A node is added after moving this far from the last one.
  static constexpr double kGraphDistance_m = 0.5;
  /// A node is added after rotating this far from the last one.
  static constexpr double kGraphAngle_rad = 0.52;
  /// Number of consecutive keyframes of a submap.
  static constexpr int kSubmapKeyframes = 10;
  /// Cell size of the submaps' likelihood rasters.
  static constexpr double kRasterResolution_m = 0.05;
  /// Standard deviation of the likelihood around a point.
  static constexpr double kRasterSigma_m = 0.06;
  /// Maximum range of the points used for loop search.
  static constexpr double kMaxPointRange_m = 20;
  /// Maximum number of points of a scan used for loop search.
  static constexpr int kMaxSearchPoints = 120;
  /// A loop spans at least so many keyframes: nearer ones see the same as odometry did.
  static constexpr int kMinKeyframesApart = 12;
  /// Maximum number of submaps searched per keyframe; 0: no loops.
  static constexpr int kMaxSubmapsTried = 2;
  /// Maximum distance of a searched submap, in addition to the uncertainty.
  static constexpr double kMaxLoopDistance_m = 3;
  /// Half width of the search window in standard deviations.
  static constexpr double kWindowSigmas = 3;
  double max_window_m = 8;
  /// Minimum half width of the search window.
  static constexpr double kMinWindow_m = 0.5;
  /// Minimum half width of the search window in angle.
  static constexpr double kMinWindow_rad = 0.15;
  /// Maximum half width of the search window in angle.
  static constexpr double kMaxWindow_rad = 1.0;
  double min_score = 0.55, ambiguity_ratio = 0.92;
  /// Minimum number of points of a scan for loop search.
  static constexpr int kMinPoints = 40;
  PlIcpParams matcher;
  /// Maximum difference between the results of PL-ICP and of the search.
  static constexpr double kVerifyMaxTranslation_m = 0.25;
  /// Maximum difference between the results of PL-ICP and of the search.
  static constexpr double kVerifyMaxRotation_rad = 0.15;
  /// Minimum share of points paired by PL-ICP.
  static constexpr double kVerifyMinPairsRatio = 0.6;
  /// Maximum mean point-to-line distance after PL-ICP.
  static constexpr double kVerifyMaxError_m = 0.06;
  /// Standard deviation added to every edge, for errors that the matcher's covariance does not include.
  static constexpr double kEdgeSigma_m = 0.01;
  /// Standard deviation added to every edge.
  static constexpr double kEdgeSigma_rad = 0.003;
  /// Factor on the matcher's covariances.
  static constexpr double kEdgeCovarianceScale = 4;
  double max_loop_chi2 = 30;
  PoseGraphSolverParams solver{100, 9};

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"max_window_m", {0, 100}, "half the search window at most"}, self.max_window_m);
    v(ParamDoc{"min_score", {0, 1}, "mean likelihood that a loop needs"}, self.min_score);
    v(ParamDoc{"ambiguity_ratio", {0, 1}, "no loop when another place scores more than this part of it"},
      self.ambiguity_ratio);
    v(ParamDoc{"max_loop_chi2", {0, 1e9}, "loops that disagree more with the solved graph are taken out"},
      self.max_loop_chi2);
  }
};

}  // namespace hm
