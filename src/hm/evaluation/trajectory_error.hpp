#pragma once
#include <array>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "hm/core/params.hpp"
#include "hm/core/result.hpp"
#include "hm/core/statistics.hpp"
#include "hm/geometry/trajectory.hpp"

namespace hm {

/// Alignment of the estimate to the truth before comparison: none, rigid (Umeyama 1991), similarity, or
/// translation and rotation about z (for gravity-aligned estimates).
enum class TrajectoryAlignment { kNone, kSe3, kSim3, kYaw };
inline constexpr std::array<std::string_view, 4> kTrajectoryAlignmentNames{"none", "se3", "sim3", "yaw"};

/// Truth at the time of an estimated pose: the pose nearest in time (as in TUM's associate.py), or
/// interpolated between its two neighbours. The nearest one adds the motion between the two stamps to the
/// error: 3 mm at 0.6 m/s for a truth of 100 Hz.
enum class TrajectoryAssociation { kNearest, kInterpolate };
inline constexpr std::array<std::string_view, 2> kTrajectoryAssociationNames{"nearest", "interpolate"};

/// Unit of the relative error's span (delta): matched poses, seconds, or metres of the true path.
enum class RpeUnit { kFrames, kSeconds, kMetres };
inline constexpr std::array<std::string_view, 3> kRpeUnitNames{"frames", "seconds", "metres"};

struct TrajectoryErrorParams {
  TrajectoryAssociation association = TrajectoryAssociation::kInterpolate;
  double max_truth_gap_s = 0.15;
  double max_stamp_difference_s = 0.02;
  TrajectoryAlignment alignment = TrajectoryAlignment::kSe3;
  RpeUnit rpe_unit = RpeUnit::kFrames;
  double rpe_delta = 1.0;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"association",
               {},
               "truth at the time of an estimated pose: the nearest pose, or interpolated between two"},
      self.association, kTrajectoryAssociationNames);
    v(ParamDoc{"max_truth_gap_s", {0, 1000}, "interpolate: largest time between the two true poses"},
      self.max_truth_gap_s);
    v(ParamDoc{"max_stamp_difference_s", {0, 10}, "nearest: largest time difference of the two poses"},
      self.max_stamp_difference_s);
    v(ParamDoc{"alignment",
               {},
               "transform by which the estimate is aligned to the truth first",
               ParamLevel::kBasic},
      self.alignment, kTrajectoryAlignmentNames);
    v(ParamDoc{"rpe_unit", {}, "unit of rpe_delta", ParamLevel::kBasic}, self.rpe_unit, kRpeUnitNames);
    v(ParamDoc{"rpe_delta", {1e-6, 1e6}, "span of the relative pose error, in rpe_unit", ParamLevel::kBasic},
      self.rpe_delta);
  }
};

/// True and estimated pose at the same time.
struct PosePair {
  Time stamp;
  SE3 T_world_truth;
  SE3 T_world_estimate;
};

/// Similarity transform p -> scale * rotation * p + translation.
struct SimilarityTransform {
  double scale = 1.0;
  Mat3 rotation = Mat3::Identity();
  Vec3 translation = Vec3::Zero();
  Vec3 operator*(const Vec3& p) const { return scale * (rotation * p) + translation; }
};

struct RelativeError {
  Time stamp;  ///< of the first pose of the span
  double translation_m = 0;
  double rotation_rad = 0;
};

/// Relative pose error over all overlapping spans of one length.
struct RelativeErrors {
  RpeUnit unit = RpeUnit::kFrames;
  double delta = 1.0;
  std::vector<RelativeError> spans;
  Summary translation_m, rotation_rad;
};

struct TrajectoryError {
  Summary position_m;        ///< absolute trajectory error (ATE); usually reported as rmse
  Summary position_given_m;  ///< the same without alignment
  /// Angle between true and estimated orientation after the alignment by positions, as is usual. Not
  /// meaningful where `rotation_undetermined`.
  Summary rotation_rad;
  /// The same after the orientations were aligned on their own, by R_own: for any path.
  Summary rotation_own_rad;
  RelativeErrors relative;    ///< over the span set in the parameters
  RelativeErrors per_frame;   ///< from each matched pose to the next
  RelativeErrors per_second;  ///< over one second
  RelativeErrors per_metre;   ///< over one metre of the true path; empty when it is shorter
  std::size_t pairs = 0;
  double truth_path_m = 0;     ///< length of the true path through the pairs
  double estimate_path_m = 0;  ///< length of the estimated path through the pairs, as given
  /// Size of the estimate relative to the truth: the inverse of a similarity alignment's scale, whatever the
  /// `alignment`. Nothing where one of the two hardly moves.
  std::optional<double> size_ratio;
  /// True when that is off by more than 10 %, and the similarity leaves less than half of the error that a
  /// rigid alignment leaves: it is the scale, not an estimate that has little to do with the truth.
  bool wrong_size = false;
  SimilarityTransform alignment;
  /// Rotation that minimises the chordal distances of the orientations, sum |R_truth - R_own R_estimate|^2
  /// (Hartley et al. 2013, "Rotation averaging", 5.3), of the same kind as `alignment` (none, yaw, any).
  Mat3 R_own = Mat3::Identity();
  /// How far position errors of the size of the remaining ones can turn the alignment: e / s, with e their
  /// root mean square (of n - 2 of n poses), and s that of the positions' distances from the axis about which
  /// the positions determine the rotation worst. It is a bound (Cauchy-Schwarz) for small angles. s^2 is the
  /// least second derivative of the alignment's cost in the angle, the least eigenvalue of tr(M) I - M with M
  /// the cross-covariance of true and aligned positions. Infinite on a line or a point.
  double alignment_uncertainty_rad = 0;
  /// True when rotation_rad says more about the alignment than about the orientations: the uncertainty is
  /// over 0.5 rad; or it is over 0.05 rad, rotation_rad is over twice rotation_own_rad (rmse), and the
  /// uncertainty explains how far the two alignments are turned against each other. Happens on nearly
  /// straight and on tiny paths.
  bool rotation_undetermined = false;
  std::vector<PosePair> matched;          ///< estimate already aligned
  std::vector<double> position_errors_m;  ///< one per matched pair
};

/// Root mean square of rotation_rad; nothing where it is undetermined.
std::optional<double> rotation_rmse_rad(const TrajectoryError& error);

/// True when most poses of the two are the same within the digits of a file (2 um, 1e-5 rad; as given or
/// after the alignment): then one was made from the other, and nothing was measured.
bool is_of_one_source(const TrajectoryError& error);

/// Pairs each estimated pose with the truth interpolated at its stamp (or, for the nearest: one to one,
/// closest stamps first). In order of time.
std::vector<PosePair> associate(const Trajectory& truth, const Trajectory& estimate,
                                const TrajectoryErrorParams& params);

/// Least-squares similarity from `from` to `to` (Umeyama 1991, eqs. 40-42; kYaw: rotation about z only;
/// kNone: identity). Both must have the same number of points, at least one.
SimilarityTransform align_points(std::span<const Vec3> from, std::span<const Vec3> to,
                                 TrajectoryAlignment kind);

/// Errors of the motion over each span of `delta` units starting at a pair (Sturm et al. 2012, eq. 1), not
/// divided by `delta`. A span ends at the first pair at least `delta` away; spans longer than 1.5 `delta`
/// (gaps in the recording) are skipped.
RelativeErrors relative_errors(std::span<const PosePair> pairs, RpeUnit unit, double delta);

/// Names of the two trajectories in Error::where of evaluate_trajectory().
inline constexpr const char *kEstimatedTrajectory = "the estimated trajectory",
                            *kTrueTrajectory = "the true trajectory";

/// Absolute and relative error of an estimated trajectory (Sturm et al. 2012, section IV). Error when fewer
/// than three poses match, when a pose is not a rigid motion, or when a scale is requested for a path without
/// motion; `where` says which of the two is at fault where it is one.
Result<TrajectoryError> evaluate_trajectory(const Trajectory& truth, const Trajectory& estimate,
                                            const TrajectoryErrorParams& params = {});

}  // namespace hm
