#pragma once
#include "hm/core/params.hpp"

namespace hm {

/// Parameters of the default method (OdometryMethod::kTracker).
struct TrackerParams {
  /// Maximum number of landmarks; the oldest are dropped.
  int max_model_points = 5000;
  int max_keyframes = 60;
  /// Number of landmarks searched for in a frame.
  static constexpr int kTargetLandmarks = 220;
  /// Minimum number of inlier landmarks of a valid pose.
  static constexpr int kMinInliers = 15;
  /// Number of keyframes in the window adjustment.
  static constexpr int kWindowKeyframes = 7;
  /// A new keyframe is added when fewer than this share of the last one's landmarks are found.
  static constexpr double kKeyframeInlierRatio = 0.65;
  /// A new keyframe is added when moved by this share of the scene's depth.
  static constexpr double kKeyframeDistanceRatio = 0.10;
  /// Rotation that triggers a new keyframe.
  static constexpr double kKeyframeAngle_rad = 0.20;
  /// Standard deviation of a match in addition to that of its patch alignment.
  static constexpr double kPixelSigma_px = 0.5;
  /// Weight of the point-to-plane distances to the keyframe's surface.
  double surface_weight_ratio = 0.03;
  bool motion_filter = true;
  /// Largest standard deviation of a valid position; beyond it the frame is lost.
  static constexpr double kLostSigma_m = 0.05;
  bool estimate_row_times = true;
  double readout_s = 0, color_delay_s = 0;
  /// Number of lost frames after which a new submap starts.
  int submap_after_frames = 60;
  /// Time after which a new submap starts when lost, if earlier than submap_after_frames.
  static constexpr double kSubmapAfter_s = 2;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"max_keyframes", {4, 10000}, "maximum number of keyframes; the oldest are dropped"},
      self.max_keyframes);
    v(
        ParamDoc{
            "motion_filter", {}, "smooth the output poses by the depth surfaces' motion from frame to frame"},
        self.motion_filter);
    v(ParamDoc{"estimate_row_times",
               {},
               "estimate readout_s and color_delay_s from the images; otherwise they are used as given"},
      self.estimate_row_times);
    v(
        ParamDoc{
            "readout_s",
            {-0.1, 0.1},
            "time from the first row of a colour image to the last; 0: global shutter, or a known sensor's"},
        self.readout_s);
    v(ParamDoc{"color_delay_s",
               {-0.1, 0.1},
               "time from the depth image of a frame to the middle row of its colour image"},
      self.color_delay_s);
  }
};

}  // namespace hm
