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
  /// Points further away are not used.
  static constexpr double kMaxPointRange_m = 12;
  /// Points of a scan that are used.
  static constexpr int kMaxPoints = 100;
  /// Scans with fewer points are not sought.
  static constexpr int kMinPoints = 30;
  double window_m = 0.8, max_window_m = 4;
  /// Half the window.
  static constexpr double kWindow_rad = 3.15;
  double min_score = 0.5;
  /// Score that a pose loses for a velocity beyond the predicted one, per (m/s)^2.
  static constexpr double kShiftPenaltyS2PerM2 = 0.1;
  /// Score that a pose loses for an angular velocity beyond the predicted one, per (rad/s)^2.
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

/// A scan found among the last keyframes of its odometry.
struct FoundScan {
  SE2 T_odom_base;
  Mat3 covariance = Mat3::Zero();  ///< of (x, y, angle), x and y along the axes of `odom`
  double score = 0;
};

/// Where a scan is, when the prediction of its motion is bad or there is none: correlative search in the last
/// keyframes (Olson, ICRA 2009), places far from the prediction needing a better fit, confirmed by PL-ICP
/// against the keyframe that sees most of the same. Deterministic; not thread safe.
class MotionSearch {
 public:
  explicit MotionSearch(const MotionSearchParams& params = {}, const PlIcpParams& matcher = {});

  /// A scan whose place in `odom` is known.
  void add(const PlanarScan& scan, const SE2& T_odom_base);
  /// Nothing when it is not found, or PL-ICP does not confirm it. `elapsed_s`: since the pose that the
  /// prediction comes from; the longer, the less the prediction counts.
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
  std::optional<CorrelativeMap> raster_;  // of keyframes_; made when first used
  int failures_ = 0;
};

}  // namespace hm
