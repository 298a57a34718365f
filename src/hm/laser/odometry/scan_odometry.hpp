#pragma once
#include <cstddef>
#include <functional>
#include <optional>
#include <string_view>

#include "hm/laser/matching/pl_icp.hpp"
#include "hm/laser/odometry/body_velocity.hpp"

namespace hm {

struct ScanOdometryParams {
  PlIcpParams matcher;
  bool use_keyframes = true;
  double keyframe_distance_m = 2.0, keyframe_angle_rad = 1.0;
  /// A new keyframe when a smaller share of the points is paired.
  double keyframe_min_pairs_ratio = 0.6;
  bool use_velocity = true;
  /// Gain of the pose in the velocity filter.
  static constexpr double kVelocityAlpha = 0.9;
  /// Gain of the velocity in the velocity filter.
  static constexpr double kVelocityBeta = 0.5;
  int reference_scans = 100;
  double max_gap_s = 1.0;
  int max_failures = 5;
  /// A match that pairs a smaller share of the points is no better than a search.
  static constexpr double kFindMinPairsRatio = 0.3;

  /// The odometry of 2.2.1 with the dissertation's example thresholds (0.2 m, 20 degrees).
  static ScanOdometryParams dissertation() {
    ScanOdometryParams params;
    params.matcher = PlIcpParams::dissertation();
    params.keyframe_distance_m = 0.2;
    params.keyframe_angle_rad = 0.349;
    params.keyframe_min_pairs_ratio = 0;
    params.reference_scans = 1;
    return params;
  }

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    PlIcpParams::visit(self.matcher, v);
    v(ParamDoc{"use_keyframes", {}, "match against the last keyframe instead of the last scan"},
      self.use_keyframes);
    v(ParamDoc{"keyframe_distance_m", {0, 100}, "a new keyframe when the last one is further away"},
      self.keyframe_distance_m);
    v(ParamDoc{"keyframe_angle_rad", {0, 3.2}, "a new keyframe when turned further from the last one"},
      self.keyframe_angle_rad);
    v(
        ParamDoc{
            "use_velocity", {}, "predict with the velocity of the last scans where nothing better is given"},
        self.use_velocity);
    v(ParamDoc{"reference_scans", {1, 1000}, "scans averaged in the reference; 1: the keyframe's scan alone"},
      self.reference_scans);
    v(ParamDoc{"max_gap_s", {1e-3, 1e6}, "after a longer gap the velocity counts as unknown"},
      self.max_gap_s);
    v(ParamDoc{"max_failures", {1, 1000}, "after so many scans without a match a new reference is begun"},
      self.max_failures);
  }
};

/// Where a scan was found by other means than matching from a prediction.
struct FoundPose {
  SE2 T_odom_base;
  Mat3 covariance = Mat3::Zero();  ///< of (x, y, angle), x and y along the axes of `odom`
};
/// Finds a scan in what was seen before, given where it is thought to be; nothing when it does not.
using PoseFinder =
    std::function<std::optional<FoundPose>(const PlanarScan& scan, const SE2& T_odom_base_predicted)>;

/// What is known of the motion since the last scan that was processed, from elsewhere. Precedence, part by
/// part: yaw_change_rad over odometry over velocity over the odometry's own velocity over nothing.
struct MotionPrediction {
  std::optional<SE2> T_last_now;         ///< from wheel odometry: base now in the base at the last scan
  std::optional<Vec3> velocity_base;     ///< vx, vy (m/s), yaw rate (rad/s) in the base frame
  std::optional<double> yaw_change_rad;  ///< from an inertial unit
  /// Asked where matching from the prediction fails or pairs too little; with `find_first` before matching.
  PoseFinder find = {};
  bool find_first = false;
};

enum class OdometryStatus {
  kFirstScan,  ///< the frame `odom` begins here
  kTracking,
  kFound,          ///< not matched, but found by MotionPrediction::find: a new reference is begun there
  kMatchFailed,    ///< see match.status; the reference is kept
  kRestarted,      ///< lost for max_failures scans: the scan became the reference, at the predicted pose
  kTimeBackwards,  ///< the stamp is not later than the last one: the scan was ignored
  kTooFewPoints,   ///< a first scan that cannot be a reference: ignored
};
std::string_view to_string(OdometryStatus status);

/// What one scan gave.
struct OdometryStep {
  Time stamp;
  OdometryStatus status = OdometryStatus::kTooFewPoints;
  std::optional<SE2> T_odom_base;      ///< nothing unless kFirstScan, kTracking, kFound or kRestarted
  SE2 T_odom_base_predicted;           ///< before matching
  std::optional<SE2> T_keyframe_base;  ///< in the reference that it was matched against
  /// Of (x, y, angle) of T_odom_base, x and y along the axes of `odom`: keyframes' errors added up. Grows
  /// without bound, as odometry does.
  Mat3 covariance = Mat3::Zero();
  bool new_keyframe = false;  ///< this scan is the reference of the next ones
  bool after_gap = false;     ///< more than max_gap_s since the last scan: no velocity was assumed
  std::size_t keyframe = 0;   ///< number of the reference that it was matched against
  bool searched = false;      ///< MotionPrediction::find was called
  ScanMatch match;            ///< kFound: its covariance is that of the finder
};

/// Pose of the vehicle's base in the plane from scans alone (dissertation 2.2.1): PL-ICP against keyframes
/// with a prediction of the motion. `odom` is the base at the first scan (or where start() put it); it never
/// jumps but by kRestarted, and is never corrected.
///
/// Not thread safe; deterministic; no heap in process() once it has seen scans of the size.
class ScanOdometry {
 public:
  explicit ScanOdometry(const ScanOdometryParams& params = {});

  /// Begins anew: the next scan is the first, at this pose.
  void start(const SE2& T_odom_base = {});
  OdometryStep process(const PlanarScan& scan, const MotionPrediction& prediction = {});

  /// vx, vy (m/s) and yaw rate (rad/s) in the base frame, as estimated from the last scans.
  [[nodiscard]] const Vec3& velocity_base() const { return velocity_.velocity(); }
  [[nodiscard]] const ScanOdometryParams& params() const { return params_; }

 private:
  OdometryStep begin(const PlanarScan& scan);
  [[nodiscard]] SE2 predicted_motion(double dt_s, const MotionPrediction& prediction) const;
  void match(const PlanarScan& scan, const MotionPrediction& prediction, OdometryStep& step);
  [[nodiscard]] bool is_well_paired(const ScanMatch& match) const;
  void track(OdometryStep& step);
  void adopt(const PlanarScan& scan, const FoundPose& found, OdometryStep& step);
  void conclude(const SE2& T_odom_base);
  void begin_keyframe(OdometryStep& step);
  void lose(const PlanarScan& scan, OdometryStep& step);
  [[nodiscard]] bool wants_keyframe(const ScanMatch& match) const;

  ScanOdometryParams params_;
  PlIcp matcher_;
  BodyVelocity velocity_;
  std::optional<Time> last_stamp_;
  SE2 T_odom_base_, T_odom_keyframe_;
  SE2 T_base_predicted_;  // motion predicted since T_odom_base_ was matched, over failed scans
  Mat3 keyframe_covariance_ = Mat3::Zero();
  double unmatched_s_ = 0;  // since T_odom_base_ was matched
  std::size_t keyframes_ = 0;
  int failures_ = 0;
};

}  // namespace hm
