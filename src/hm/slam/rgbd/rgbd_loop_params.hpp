#pragma once
#include "hm/core/params.hpp"
#include "hm/slam/places/place_params.hpp"
#include "hm/slam/pose_graph/pose_graph_2d_solver.hpp"

namespace hm {

/// Global alignment of RGB-D keyframes (dissertation 3.3).
struct RgbdLoopParams {
  bool enabled = true;
  PlaceSearchParams search;
  PlaceVerifierParams verifier;
  int loops_per_solution = 4;
  bool bundle_adjustment = true;
  bool match_covisible = true;
  double bundle_edge_ratio = 0.1;
  double odometry_sigma_m = 0.003, odometry_sigma_rad = 0.002;
  double odometry_drift_ratio = 0.01, odometry_drift_rad_m = 0.004;
  double odometry_floor_m = 0.0003, odometry_floor_ratio = 0.001;
  double odometry_floor_rad = 0.0002, odometry_floor_rad_m = 0.0004;
  double gate_chi2 = 22.5;
  double gate_drift_ratio = 0.02, gate_drift_rad_m = 0.003;
  double rival_ratio = 0.6;
  double large_correction_m = 0.3, large_correction_rad = 0.1;
  int max_waiting_keyframes = 30;
  double min_information_gain_ratio = 1;
  double max_loop_chi2 = 40;
  PoseGraphSolverParams solver{50, 9};

  /// Its own; search, verifier and solver are sections of their own (some of their names are the same).
  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"enabled", {}, "look for places seen before"}, self.enabled);
    v(ParamDoc{"loops_per_solution", {1, 100000}, "new loops after which the graph is solved"},
      self.loops_per_solution);
    v(ParamDoc{"bundle_adjustment", {}, "at the end, adjust keyframes and their features together"},
      self.bundle_adjustment);
    v(ParamDoc{"match_covisible",
               {},
               "before they are adjusted, match features of all keyframes that see the same place"},
      self.match_covisible);
    v(ParamDoc{"bundle_edge_ratio",
               {0, 1},
               "share of odometry's information that the adjustment keeps besides features"},
      self.bundle_edge_ratio);
    v(ParamDoc{"odometry_sigma_m",
               {1e-5, 1},
               "deviation of odometry between keyframes that states none, constant part"},
      self.odometry_sigma_m);
    v(ParamDoc{"odometry_sigma_rad", {1e-5, 1}, "the same of rotation"}, self.odometry_sigma_rad);
    v(ParamDoc{"odometry_drift_ratio", {0, 1}, "and the part that grows with the way"},
      self.odometry_drift_ratio);
    v(ParamDoc{"odometry_drift_rad_m", {0, 1}, "the same of rotation"}, self.odometry_drift_rad_m);
    v(ParamDoc{"odometry_floor_m", {0, 1}, "added to odometry's own deviation, constant part"},
      self.odometry_floor_m);
    v(ParamDoc{"odometry_floor_rad", {0, 1}, "the same of rotation"}, self.odometry_floor_rad);
    v(ParamDoc{"odometry_floor_ratio", {0, 1}, "and the part that grows with the way"},
      self.odometry_floor_ratio);
    v(ParamDoc{"odometry_floor_rad_m", {0, 1}, "the same of rotation"}, self.odometry_floor_rad_m);
    v(ParamDoc{"gate_chi2", {0, 1e9}, "a loop further than this from what odometry allows is none"},
      self.gate_chi2);
    v(ParamDoc{"gate_drift_ratio", {0, 1}, "systematic drift that the gate allows, by length of way"},
      self.gate_drift_ratio);
    v(ParamDoc{"gate_drift_rad_m", {0, 1}, "the same of rotation"}, self.gate_drift_rad_m);
    v(ParamDoc{"place_rival_ratio",
               {0, 1},
               "no loop when another place explains this part of its features as well"},
      self.rival_ratio);
    v(ParamDoc{"large_correction_m",
               {0, 1e6},
               "a loop that corrects more must be confirmed by another keyframe's"},
      self.large_correction_m);
    v(ParamDoc{"large_correction_rad", {0, 3.2}, "the same of rotation"}, self.large_correction_rad);
    v(ParamDoc{"max_waiting_keyframes", {1, 100000}, "a loop that is not confirmed by then is dropped"},
      self.max_waiting_keyframes);
    v(ParamDoc{"min_information_gain_ratio",
               {0, 1e9},
               "a loop becomes an edge when the graph's variance of its motion is larger by this factor"},
      self.min_information_gain_ratio);
    v(ParamDoc{"max_loop_chi2", {0, 1e9}, "loops that disagree more with the solved graph are taken out"},
      self.max_loop_chi2);
  }
};

}  // namespace hm
