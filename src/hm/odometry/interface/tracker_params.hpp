#pragma once
#include "hm/core/params.hpp"

namespace hm {

/// Parameters of the default method (OdometryMethod::kTracker).
struct TrackerParams {
  int max_model_points = 5000;
  int max_keyframes = 60;
  int target_landmarks = 220;
  int min_inliers = 15;
  int window_keyframes = 7;
  double keyframe_inlier_ratio = 0.65;
  double keyframe_distance_ratio = 0.10;
  double keyframe_angle_rad = 0.20;
  double pixel_sigma_px = 0.5;
  double surface_weight_ratio = 0.03;
  bool motion_filter = true;
  double lost_sigma_m = 0.05;
  int submap_after_frames = 60;
  double submap_after_s = 2;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"max_model_points", {100, 1e6}, "landmarks kept; the oldest go first"}, self.max_model_points);
    v(ParamDoc{"max_keyframes", {4, 10000}, "keyframes kept; the oldest go first"}, self.max_keyframes);
    v(ParamDoc{"target_landmarks", {30, 2000}, "landmarks looked for in a frame"}, self.target_landmarks);
    v(ParamDoc{"min_inliers", {6, 1000}, "landmarks that must agree with a pose"}, self.min_inliers);
    v(ParamDoc{"window_keyframes", {1, 30}, "keyframes that the window adjustment moves"},
      self.window_keyframes);
    v(ParamDoc{"keyframe_inlier_ratio",
               {0, 1},
               "a keyframe is due below this share of the last one's landmarks"},
      self.keyframe_inlier_ratio);
    v(ParamDoc{"keyframe_distance_ratio", {0.001, 10}, "or when moved by this share of the scene's depth"},
      self.keyframe_distance_ratio);
    v(ParamDoc{"keyframe_angle_rad", {0.01, 3}, "or turned by this"}, self.keyframe_angle_rad);
    v(ParamDoc{"pixel_sigma_px", {0.01, 10}, "deviation of a match besides its patch's own"},
      self.pixel_sigma_px);
    v(ParamDoc{"surface_weight_ratio", {0, 10}, "weight of the distances to the keyframe's surface"},
      self.surface_weight_ratio);
    v(ParamDoc{"motion_filter", {}, "poses follow the depth's surfaces from frame to frame"},
      self.motion_filter);
    v(ParamDoc{"lost_sigma_m", {1e-3, 10}, "a pose less certain than this counts as lost"},
      self.lost_sigma_m);
    v(ParamDoc{"submap_after_frames", {1, 1e6}, "frames after which a new submap begins when lost"},
      self.submap_after_frames);
    v(ParamDoc{"submap_after_s", {0, 1e6}, "or time, whichever is over first"}, self.submap_after_s);
  }
};

}  // namespace hm
