#pragma once
#include "hm/core/params.hpp"
#include "hm/laser/matching/pl_icp_params.hpp"
#include "hm/slam/pose_graph/pose_graph_2d_solver.hpp"

namespace hm {

/// Parameters of the 2D scan graph. `matcher` and `solver` have names of their own: they are listed apart.
struct ScanGraph2DParams {
  double graph_distance_m = 0.5, graph_angle_rad = 0.52;
  int submap_keyframes = 10;
  double raster_resolution_m = 0.05, raster_sigma_m = 0.06;
  double max_point_range_m = 20;
  int max_search_points = 120;
  int min_keyframes_apart = 12;
  int max_submaps_tried = 2;
  double max_loop_distance_m = 3;
  double window_sigmas = 3;
  double min_window_m = 0.5, min_window_rad = 0.15, max_window_m = 8, max_window_rad = 1.0;
  double min_score = 0.55, ambiguity_ratio = 0.92;
  int min_points = 40;
  PlIcpParams matcher;
  double verify_max_translation_m = 0.25, verify_max_rotation_rad = 0.15;
  double verify_min_pairs_ratio = 0.6, verify_max_error_m = 0.06;
  double edge_sigma_m = 0.01, edge_sigma_rad = 0.003;
  double edge_covariance_scale = 4;
  double max_loop_chi2 = 30;
  PoseGraphSolverParams solver{100, 9};

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"graph_distance_m", {0, 100}, "a node of the graph when the last one is further away"},
      self.graph_distance_m);
    v(ParamDoc{"graph_angle_rad", {0, 3.2}, "a node of the graph when turned further from the last one"},
      self.graph_angle_rad);
    v(ParamDoc{"submap_keyframes", {1, 1000}, "consecutive keyframes that make up a submap"},
      self.submap_keyframes);
    v(ParamDoc{"raster_resolution_m", {0.01, 1}, "cell of the submaps' likelihood rasters"},
      self.raster_resolution_m);
    v(ParamDoc{"raster_sigma_m", {0.005, 1}, "spread of the likelihood about a point"}, self.raster_sigma_m);
    v(ParamDoc{"max_point_range_m", {1, 500}, "points further away are not used to find loops"},
      self.max_point_range_m);
    v(ParamDoc{"max_search_points", {10, 10000}, "points of a scan that the search for loops uses"},
      self.max_search_points);
    v(ParamDoc{"min_keyframes_apart", {1, 100000}, "a loop spans at least so many keyframes"},
      self.min_keyframes_apart);
    v(ParamDoc{"max_submaps_tried", {0, 1000}, "submaps that a keyframe is searched in at most; 0: no loops"},
      self.max_submaps_tried);
    v(
        ParamDoc{
            "max_loop_distance_m", {0, 100}, "submaps further away (beyond the uncertainty) are not tried"},
        self.max_loop_distance_m);
    v(ParamDoc{"window_sigmas", {0.5, 10}, "half the search window in standard deviations"},
      self.window_sigmas);
    v(ParamDoc{"min_window_m", {0, 10}, "half the search window at least"}, self.min_window_m);
    v(ParamDoc{"min_window_rad", {0, 3.2}, "half the search window at least"}, self.min_window_rad);
    v(ParamDoc{"max_window_m", {0, 100}, "half the search window at most"}, self.max_window_m);
    v(ParamDoc{"max_window_rad", {0, 3.2}, "half the search window at most"}, self.max_window_rad);
    v(ParamDoc{"min_score", {0, 1}, "mean likelihood that a loop needs"}, self.min_score);
    v(ParamDoc{"ambiguity_ratio", {0, 1}, "no loop when another place scores more than this part of it"},
      self.ambiguity_ratio);
    v(ParamDoc{"min_points", {3, 10000}, "scans with fewer points close no loops"}, self.min_points);
    v(ParamDoc{"verify_max_translation_m", {0, 10}, "PL-ICP must agree with the search within this"},
      self.verify_max_translation_m);
    v(ParamDoc{"verify_max_rotation_rad", {0, 3.2}, "PL-ICP must agree with the search within this"},
      self.verify_max_rotation_rad);
    v(ParamDoc{"verify_min_pairs_ratio", {0, 1}, "share of the points that PL-ICP must pair"},
      self.verify_min_pairs_ratio);
    v(ParamDoc{"verify_max_error_m", {0, 1}, "mean distance from line that PL-ICP may leave"},
      self.verify_max_error_m);
    v(ParamDoc{"edge_sigma_m", {1e-5, 1}, "added to every edge: what a matcher does not know of itself"},
      self.edge_sigma_m);
    v(ParamDoc{"edge_sigma_rad", {1e-5, 1}, "added to every edge"}, self.edge_sigma_rad);
    v(ParamDoc{"edge_covariance_scale", {0, 1000}, "factor on the matcher's covariances"},
      self.edge_covariance_scale);
    v(ParamDoc{"max_loop_chi2", {0, 1e9}, "loops that disagree more with the solved graph are taken out"},
      self.max_loop_chi2);
  }
};

}  // namespace hm
