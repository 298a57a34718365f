#pragma once
#include <deque>
#include <optional>

#include "hm/core/params.hpp"
#include "hm/laser/matching/pl_icp.hpp"
#include "hm/slam/laser/correlative_map.hpp"

namespace hm {

struct MotionSearchParams {
  int keyframes = 12;
  double keyframe_distance_m = 0.3, keyframe_angle_rad = 0.35;
  double sigma_m = 0.08;
  /// Maximum range of the points used.
  static constexpr double kMaxPointRange_m = 12;
  /// Maximum number of points used per scan.
  static constexpr int kMaxPoints = 100;
  /// Minimum number of points of a scan.
  static constexpr int kMinPoints = 30;
  double window_m = 0.8, max_window_m = 4;
  /// Half width of the window in angle.
  static constexpr double kWindow_rad = 3.15;
  double min_score = 0.5;
  /// Score penalty for the deviation from the predicted velocity, per (m/s)^2.
  static constexpr double kShiftPenaltyS2PerM2 = 0.1;
  /// Score penalty for the deviation from the predicted angular velocity, per (rad/s)^2.
  static constexpr double kTurnPenaltyS2PerRad2 = 0.03;
  double min_pairs_ratio = 0.4, max_error_m = 0.06;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"keyframes", {1, 1000}, "last keyframes that are searched for a scan"}, self.keyframes);
    v(ParamDoc{"keyframe_distance_m", {0, 100}, "a keyframe when the last one is further away"},
      self.keyframe_distance_m);
    v(ParamDoc{"keyframe_angle_rad", {0, 3.2}, "a keyframe when turned further from the last one"},
      self.keyframe_angle_rad);
    v(ParamDoc{"sigma_m", {0.005, 1}, "spread of the likelihood about a point"}, self.sigma_m);
    v(ParamDoc{"window_m", {0.01, 50}, "half the window; wider by as much with every scan that is not found"},
      self.window_m);
    v(ParamDoc{"max_window_m", {0.01, 50}, "half the window at most"}, self.max_window_m);
    v(ParamDoc{"min_score", {0, 1}, "mean likelihood of the points that is needed"}, self.min_score);
    v(ParamDoc{"min_pairs_ratio", {0, 1}, "share of the points that PL-ICP must pair afterwards"},
      self.min_pairs_ratio);
    v(ParamDoc{"max_error_m", {0, 1}, "mean distance from line that PL-ICP may leave"}, self.max_error_m);
  }
};

/// Pose of a scan relative to the last keyframes.
struct FoundScan {
  SE2 T_odom_base;
  Mat3 covariance = Mat3::Zero();  ///< of (x, y, angle) in `odom`
  double score = 0;
};

/// Finds the pose of a scan when its motion prediction is inaccurate or missing: correlative search in the
/// last keyframes (Olson, ICRA 2009) with a penalty on the distance from the prediction, then verification by
/// PL-ICP against the nearest keyframe. Deterministic; not thread safe.
class MotionSearch {
 public:
  explicit MotionSearch(const MotionSearchParams& params = {}, const PlIcpParams& matcher = {});

  /// Adds a scan with known pose.
  void add(const PlanarScan& scan, const SE2& T_odom_base);
  /// Finds the pose of a scan; nothing if no match is found or PL-ICP does not confirm it. `elapsed_s`: time
  /// since the pose that the prediction is based on; the penalty decreases with it.
  std::optional<FoundScan> find(const PlanarScan& scan, const SE2& T_odom_base_predicted,
                                double elapsed_s = 1);
  void clear();

 private:
  struct Keyframe {
    PlanarScan scan;
    SE2 T_odom_base;
  };
  const CorrelativeMap& raster();
  std::optional<FoundScan> confirmed(const PlanarScan& scan, const SE2& T_odom_base);

  MotionSearchParams params_;
  PlIcp matcher_;
  std::deque<Keyframe> keyframes_;
  std::optional<CorrelativeMap> raster_;  // of keyframes_; built on first use
  int failures_ = 0;
};

}  // namespace hm
