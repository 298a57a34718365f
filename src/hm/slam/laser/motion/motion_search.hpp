#pragma once
#include <optional>
#include <vector>

#include "hm/core/params.hpp"
#include "hm/laser/matching/pl_icp.hpp"
#include "hm/slam/laser/motion/recent_keyframes.hpp"
#include "hm/slam/laser/scan_agreement.hpp"
#include "hm/slam/laser/search/correlative_map.hpp"

namespace hm {

struct MotionSearchParams {
  /// Spread of the likelihood about a point.
  static constexpr double kSigma_m = 0.15;
  /// Maximum range of the points used.
  static constexpr double kMaxPointRange_m = 12;
  /// Maximum number of points used per scan.
  static constexpr int kMaxPoints = 100;
  /// Minimum number of points of a scan.
  static constexpr int kMinPoints = 30;
  double window_m = 0.8;
  /// Half the window at most.
  static constexpr double kMaxWindow_m = 4;
  double min_score = 0.5;
  /// Penalty for the deviation from the predicted velocity, per (m/s)^2.
  static constexpr double kShiftPenaltyS2PerM2 = 0.1;
  /// Penalty for the deviation from the predicted angular velocity, per (rad/s)^2.
  static constexpr double kTurnPenaltyS2PerRad2 = 0.03;
  /// Share of the points that PL-ICP must pair to refine a place.
  static constexpr double kMinPairsRatio = 0.1;
  /// Mean distance from line that PL-ICP may leave.
  static constexpr double kMaxError_m = 0.06;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"window_m", {0.01, 50}, "half the window; wider by as much with every scan that is not found"},
      self.window_m);
    v(ParamDoc{"min_score", {0, 1}, "mean likelihood of the points that is needed"}, self.min_score);
  }
};

/// Pose of a scan relative to the last keyframes.
struct FoundScan {
  SE2 T_odom_base;
  Mat3 covariance = Mat3::Zero();  ///< of (x, y, angle) in `odom`
  double score = 0;
  bool sure = true;  ///< it fits well, and no other place nearly so
};

/// Where a scan is searched for.
struct MotionSearchStart {
  SE2 T_odom_base;            ///< predicted
  double half_angle_rad = 4;  ///< largest deviation of the heading; more than pi: any heading
  /// Time since the pose that the prediction is based on: the penalty on the deviation decreases with it.
  double elapsed_s = 1;
  /// Covariance of the prediction's (x, y, angle), x and y along the axes of `odom`: takes the place of that
  /// penalty.
  std::optional<Mat3> covariance = {};
};

/// Finds the pose of a scan when its motion prediction is inaccurate or missing, and judges poses found
/// otherwise.
///
/// Correlative search in the last keyframes (Olson, ICRA 2009), separately for each sector of headings. The
/// best places are refined by PL-ICP against the nearest keyframe and compared by their score, by what the
/// scan and the keyframes show of each other (ScanAgreement: overlap that is no agreement counts against a
/// place), and by the distance from the prediction. Deterministic; not thread safe.
class MotionSearch {
 public:
  explicit MotionSearch(const MotionSearchParams& params = {}, const PlIcpParams& matcher = {});

  /// Adds a scan with known pose.
  void add(const PlanarScan& scan, const SE2& T_odom_base);
  /// Finds the pose of a scan; nothing if no place scores and agrees with the keyframes well enough.
  std::optional<FoundScan> find(const PlanarScan& scan, const MotionSearchStart& start);
  /// Whether a scan at this pose and the last keyframes agree about walls and free space. True where they
  /// have too little in common to tell.
  [[nodiscard]] bool agrees(const PlanarScan& scan, const SE2& T_odom_base) const;
  void clear();

 private:
  using Keyframes = RecentKeyframes<PlanarScan>;
  struct Place {
    SE2 T_odom_base;
    double score = 0, merit = 0;
    Mat3 covariance = Mat3::Zero();
  };
  const CorrelativeMap& raster();
  std::vector<Place> places(const std::vector<Vec2>& points_m, const MotionSearchStart& start);
  void refine(const PlanarScan& scan, Place& place);
  double merit(const PlanarScan& scan, const std::vector<Vec2>& points_m, const SE2& T_odom_base,
               const MotionSearchStart& start);
  [[nodiscard]] double penalty(const MotionSearchStart& start, const SE2& T_odom_base) const;
  [[nodiscard]] ScanAgreement agreement(const PlanarScan& scan, const SE2& T_odom_base,
                                        std::size_t max_keyframes) const;

  MotionSearchParams params_;
  PlIcp matcher_;
  Keyframes keyframes_;
  std::optional<CorrelativeMap> raster_;  // of keyframes_; built on first use
  int failures_ = 0;
};

}  // namespace hm
