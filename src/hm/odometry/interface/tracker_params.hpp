#pragma once
#include "hm/core/params.hpp"

namespace hm {

/// Parameters of the default method (OdometryMethod::kTracker).
struct TrackerParams {
  int max_model_points = 5000;
  int max_keyframes = 60;
  /// Landmarks looked for in a frame.
  static constexpr int kTargetLandmarks = 220;
  int min_inliers = 15;
  /// Keyframes that the window adjustment moves.
  static constexpr int kWindowKeyframes = 7;
  /// A keyframe is due below this share of the last one's landmarks.
  static constexpr double kKeyframeInlierRatio = 0.65;
  /// Or when moved by this share of the scene's depth.
  static constexpr double kKeyframeDistanceRatio = 0.10;
  double keyframe_angle_rad = 0.20;
  double pixel_sigma_px = 0.5;
  /// Weight of the distances to the keyframe's surface.
  double surface_weight_ratio = 0.03;
  bool motion_filter = true;
  /// A pose less certain than this counts as lost.
  static constexpr double kLostSigma_m = 0.05;
  int submap_after_frames = 60;
  /// Or time, whichever is over first.
  static constexpr double kSubmapAfter_s = 2;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"max_model_points", {100, 1e6}, "landmarks kept; the oldest go first"}, self.max_model_points);
    v(ParamDoc{"max_keyframes", {4, 10000}, "keyframes kept; the oldest go first"}, self.max_keyframes);
    v(ParamDoc{"min_inliers", {6, 1000}, "landmarks that must agree with a pose"}, self.min_inliers);
    v(ParamDoc{"keyframe_angle_rad", {0.01, 3}, "or turned by this"}, self.keyframe_angle_rad);
    v(ParamDoc{"pixel_sigma_px", {0.01, 10}, "deviation of a match besides its patch's own"},
      self.pixel_sigma_px);
    v(ParamDoc{"motion_filter", {}, "poses follow the depth's surfaces from frame to frame"},
      self.motion_filter);
    v(ParamDoc{"submap_after_frames", {1, 1e6}, "frames after which a new submap begins when lost"},
      self.submap_after_frames);
  }
};

}  // namespace hm
