#pragma once
#include <cstddef>
#include <functional>
#include <optional>
#include <string_view>

#include "hm/laser/matching/pl_icp.hpp"
#include "hm/laser/odometry/body_velocity.hpp"
#include "hm/laser/odometry/motion_since.hpp"
#include "hm/laser/odometry/wheel_calibration.hpp"

namespace hm {

struct ScanOdometryParams {
  PlIcpParams matcher;
  bool use_keyframes = true;
  double keyframe_distance_m = 2.0;
  /// Rotation from the last keyframe that triggers a new one.
  double keyframe_angle_rad = 1.0;
  /// A smaller share of paired points triggers a new keyframe.
  double keyframe_min_pairs_ratio = 0.6;
  bool use_velocity = true;
  /// Gain of the pose in the velocity filter.
  static constexpr double kVelocityAlpha = 0.9;
  /// Gain of the velocity in the velocity filter.
  static constexpr double kVelocityBeta = 0.5;
  /// Number of scans averaged in the reference; 1: the keyframe's scan only.
  int reference_scans = 100;
  /// The velocity is reset after a longer gap between scans.
  static constexpr double kMaxGap_s = 1.0;
  /// Number of consecutive failed scans after which a new reference is started.
  int max_failures = 5;
  /// A match with a smaller share of paired points triggers MotionPrediction::find,
  static constexpr double kFindMinPairsRatio = 0.3;
  /// and so does one with a larger mean distance from the lines.
  static constexpr double kFindMaxError_m = 0.05;
  /// A found pose must stay this close when it is matched with the reference.
  static constexpr double kFoundMaxShift_m = 0.15, kFoundMaxTurn_rad = 0.1;

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
    v(
        ParamDoc{
            "use_keyframes", {}, "match against the last keyframe instead of the last scan, to reduce drift"},
        self.use_keyframes);
    v(
        ParamDoc{
            "keyframe_distance_m",
            {0, 100},
            "distance from the last keyframe that triggers a new one; larger drifts less but overlaps less"},
        self.keyframe_distance_m);
    v(ParamDoc{"use_velocity",
               {},
               "predict with the velocity of the last scans if no better prediction is given"},
      self.use_velocity);
  }
};

/// Pose of a scan found by other means than matching from a prediction.
struct FoundPose {
  SE2 T_odom_base;
  Mat3 covariance = Mat3::Zero();  ///< of (x, y, angle), x and y along the axes of `odom`
  bool sure = true;                ///< no other place comes near it
};
/// Pose of a scan before it is matched.
struct PredictedPose {
  SE2 T_odom_base;
  /// Covariance of (x, y, angle), x and y along the axes of `odom`, relative to the keyframe; where wheels
  /// predict it.
  std::optional<Mat3> covariance = {};
};
/// Searches for a scan in earlier data, given its predicted pose; returns nothing if not found.
using PoseFinder =
    std::function<std::optional<FoundPose>(const PlanarScan& scan, const PredictedPose& predicted)>;
/// Whether other data than the reference confirm the pose of a scan.
using PoseJudge = std::function<bool(const PlanarScan& scan, const SE2& T_odom_base)>;

/// How far a scan lies from its predicted pose along a direction, by the prediction and the scans before;
/// and the standard deviation of what these scans alone say.
struct FoundShift {
  double shift_m = 0, sigma_m = 0;
};
/// Finds it along `direction_odom`, a unit vector in `odom`, for a pose predicted with the standard deviation
/// `predicted_sigma_m` along it; nothing if it cannot be told.
using ShiftFinder = std::function<std::optional<FoundShift>(
    const PlanarScan& scan, const SE2& T_odom_base, const Vec2& direction_odom, double predicted_sigma_m)>;

/// Prediction of the motion since the last processed scan, from other sources. Precedence for each component:
/// yaw_change_rad, odometry, velocity, the estimator's own velocity, none.
struct MotionPrediction {
  std::optional<SE2> T_last_now;  ///< from wheel odometry: current base in the base frame of the last scan
  std::optional<Vec3> velocity_base;     ///< vx, vy (m/s), yaw rate (rad/s) in the base frame
  std::optional<double> yaw_change_rad;  ///< from an IMU
  /// Called when matching from the prediction fails, fits poorly or is not confirmed; with `find_first`,
  /// before matching.
  PoseFinder find = {};
  PoseJudge confirms = {};  ///< judges matches; needs `find`
  bool find_first = false;
  /// Called where few pairs or none hold the motion along walls and nothing but the estimator's own velocity
  /// predicts it.
  ShiftFinder find_along = {};
};

enum class OdometryStatus {
  kFirstScan,  ///< the frame `odom` begins here
  kTracking,
  kFound,        ///< found by MotionPrediction::find instead of matching, or predicted where nothing confirms
                 ///< a match; the scan becomes the reference
  kMatchFailed,  ///< see match.status; the reference is kept
  kRestarted,    ///< after max_failures failures: the scan becomes the reference, at the predicted pose
  kTimeBackwards,  ///< the stamp is not later than the last one; ignored
  kTooFewPoints,   ///< first scan unusable as a reference; ignored
};
std::string_view to_string(OdometryStatus status);

/// Result of processing one scan.
struct OdometryStep {
  Time stamp;
  OdometryStatus status = OdometryStatus::kTooFewPoints;
  std::optional<SE2> T_odom_base;      ///< set for kFirstScan, kTracking, kFound, kRestarted
  SE2 T_odom_base_predicted;           ///< before matching
  std::optional<SE2> T_keyframe_base;  ///< in the frame of its reference
  /// Covariance of (x, y, angle) of T_odom_base, x and y along the axes of `odom`, accumulated over
  /// keyframes; grows without bound.
  Mat3 covariance = Mat3::Zero();
  bool new_keyframe = false;  ///< this scan is the reference of the next ones
  bool after_gap = false;     ///< more than kMaxGap_s since the last scan; the velocity was reset
  std::size_t keyframe = 0;   ///< index of its reference
  bool searched = false;      ///< MotionPrediction::find was called
  /// False where neither the last scans nor the reference confirm the pose (kTracking with a match that may
  /// be wrong, kFound with the motion that wheels or the velocity gave), and for kRestarted.
  bool confirmed = true;
  /// Motion along walls since the last posed scan of which nothing but an earlier velocity says how long it
  /// is: that velocity times the time.
  double guessed_m = 0;
  /// False where neither the match, nor a search or wheels show the motion along walls.
  bool length_observed = true;
  /// Covariance of (x, y, angle) of the motion since the last posed scan as wheels say, x and y along the
  /// axes of `odom`; nothing where they do not predict all of it, or the pose contradicts them.
  std::optional<Mat3> wheel_covariance;
  ScanMatch match;  ///< kFound: with the covariance of the FoundPose
};

/// Pose of the vehicle's base in the plane from scans alone (dissertation 2.2.1): PL-ICP against keyframes
/// with a prediction of the motion. `odom` is the base frame at the first scan (or as given to start()); the
/// pose is continuous except for kRestarted, and never corrected.
///
/// Not thread safe; deterministic; no heap allocation in process() after the first scans of a size.
class ScanOdometry {
 public:
  explicit ScanOdometry(const ScanOdometryParams& params = {});

  /// Restarts: the next scan is the first one, at this pose.
  void start(const SE2& T_odom_base = {});
  OdometryStep process(const PlanarScan& scan, const MotionPrediction& prediction = {});

  /// Velocity vx, vy (m/s) and yaw rate (rad/s) in the base frame, estimated from the last scans.
  [[nodiscard]] const Vec3& velocity_base() const { return velocity_.velocity(); }
  [[nodiscard]] const ScanOdometryParams& params() const { return params_; }
  /// Calibration of the wheels so far.
  [[nodiscard]] const WheelCalibration& wheels() const { return wheels_; }

 private:
  OdometryStep begin(const PlanarScan& scan);
  [[nodiscard]] SE2 predicted_motion(double dt_s, const MotionPrediction& prediction) const;
  double motion_time(double dt_s);
  void predict(double motion_s, const MotionPrediction& prediction);
  void begin_motion();
  void hold(const ScanMatch& match);
  [[nodiscard]] PredictedPose predicted() const;
  [[nodiscard]] ScanMatch match_once(const PlanarScan& scan, const PredictedPose& pose,
                                     double least_share = 0);
  [[nodiscard]] bool match_as_wheels(const PlanarScan& scan, OdometryStep& step);
  struct WheelDeviation {
    double place_chi2, chi2;
  };
  [[nodiscard]] std::optional<WheelDeviation> deviation_from_wheels(const SE2& T_odom_base) const;
  void judge_wheels(const SE2& T_odom_base, OdometryStep& step);
  [[nodiscard]] bool confirmed_by_wheels(const ScanMatch& match) const;
  [[nodiscard]] bool agrees_with_wheels(const ScanMatch& match) const;
  void learn_wheels(const OdometryStep& step);
  void match(const PlanarScan& scan, const MotionPrediction& prediction, OdometryStep& step);
  void accept_unconfirmed(const PlanarScan& scan, const MotionPrediction& prediction, OdometryStep& step);
  [[nodiscard]] bool fits(const ScanMatch& match) const;
  [[nodiscard]] SE2 matched_pose(const ScanMatch& match) const;
  [[nodiscard]] bool stays_near(const SE2& T_odom_base, const ScanMatch& match) const;
  [[nodiscard]] bool only_velocity_predicts(const MotionPrediction& prediction) const;
  [[nodiscard]] bool accelerates_too_much(const OdometryStep& step) const;
  [[nodiscard]] double along_sigma_m() const;
  void move_along_walls(const PlanarScan& scan, const MotionPrediction& prediction, OdometryStep& step);
  void move_freely(const PlanarScan& scan, const MotionPrediction& prediction, const Vec2& along,
                   OdometryStep& step);
  void undo_weak_shift(const PlanarScan& scan, const MotionPrediction& prediction, const Vec2& along,
                       OdometryStep& step);
  bool shift_match(const PlanarScan& scan, const Vec2& shift_odom_m, double least_share, OdometryStep& step);
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
  Mat3 keyframe_covariance_ = Mat3::Zero();
  WheelCalibration wheels_;
  // Motion since T_odom_base_, over failed scans; since the last pose that more than few pairs held, or not
  // so far back; and since the last one that the wheels' calibration has learned.
  MotionSince matched_, held_, learned_;
  // Of T_odom_base_ relative to the keyframe, along the axes of `odom`, with the wheels.
  Mat3 since_keyframe_ = Mat3::Zero();
  double unmatched_s_ = 0;  // since T_odom_base_ was matched
  double spacing_s_ = 0;    // between scans, running mean
  // Of the motion along walls: its variance since the keyframe where it is free, whether it was observed, and
  // the speed when it was last observed.
  double along_variance_m2_ = 0;
  bool along_observed_ = false;
  double observed_speed_m_s_ = 0;
  std::size_t keyframes_ = 0;
  int failures_ = 0;
};

}  // namespace hm
