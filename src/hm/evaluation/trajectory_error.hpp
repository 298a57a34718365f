#pragma once
#include <array>
#include <span>
#include <string_view>
#include <vector>

#include "hm/core/params.hpp"
#include "hm/core/result.hpp"
#include "hm/core/statistics.hpp"
#include "hm/geometry/trajectory.hpp"

namespace hm {

/// What the estimate may be moved by before it is compared: nothing, a rigid motion (Umeyama 1991), a
/// similarity, or a translation and a turn about z (for estimates that know which way is up).
enum class TrajectoryAlignment { kNone, kSe3, kSim3, kYaw };
inline constexpr std::array<std::string_view, 4> kTrajectoryAlignmentNames{"none", "se3", "sim3", "yaw"};

/// How a truth pose is found for an estimated one: the nearest in time, or between its two neighbours.
enum class TrajectoryAssociation { kNearest, kInterpolate };
inline constexpr std::array<std::string_view, 2> kTrajectoryAssociationNames{"nearest", "interpolate"};

/// What the relative error's span (delta) counts: matched poses, seconds, or metres of the true path.
enum class RpeUnit { kFrames, kSeconds, kMetres };
inline constexpr std::array<std::string_view, 3> kRpeUnitNames{"frames", "seconds", "metres"};

struct TrajectoryErrorParams {
  double max_stamp_difference_s = 0.02;
  TrajectoryAssociation association = TrajectoryAssociation::kNearest;
  TrajectoryAlignment alignment = TrajectoryAlignment::kSe3;
  RpeUnit rpe_unit = RpeUnit::kFrames;
  double rpe_delta = 1.0;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"max_stamp_difference_s", {0, 10}, "largest time between two poses that are compared"},
      self.max_stamp_difference_s);
    v(ParamDoc{"association", {}, "how the true pose of a moment is found"}, self.association,
      kTrajectoryAssociationNames);
    v(
        ParamDoc{
            "alignment", {}, "motion by which the estimate is fitted to the truth first", ParamLevel::kBasic},
        self.alignment, kTrajectoryAlignmentNames);
    v(ParamDoc{"rpe_unit", {}, "unit of rpe_delta", ParamLevel::kBasic}, self.rpe_unit, kRpeUnitNames);
    v(
        ParamDoc{
            "rpe_delta", {1e-6, 1e6}, "span over which the relative pose error is taken", ParamLevel::kBasic},
        self.rpe_delta);
  }
};

/// A true and an estimated pose of the same moment.
struct PosePair {
  Time stamp;
  SE3 T_world_truth;
  SE3 T_world_estimate;
};

/// The similarity p -> scale * rotation * p + translation.
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
  Summary position_m;         ///< absolute trajectory error (ATE); its rmse is the usual number
  Summary rotation_rad;       ///< angle between true and aligned estimated orientation
  RelativeErrors relative;    ///< over the span that the parameters name
  RelativeErrors per_frame;   ///< from each matched pose to the next
  RelativeErrors per_second;  ///< over one second
  RelativeErrors per_metre;   ///< over one metre of the true path; empty when it is shorter
  std::size_t pairs = 0;
  double truth_path_m = 0;  ///< length of the true path through the pairs
  SimilarityTransform alignment;
  /// True when the positions lie on a line or a point, so that the alignment's rotation is not determined
  /// by them: position errors stand, rotation_rad means little.
  bool alignment_degenerate = false;
  std::vector<PosePair> matched;          ///< estimate already aligned
  std::vector<double> position_errors_m;  ///< one per matched pair
};

/// Pairs the poses of two trajectories by time, one to one, closest stamps first (or, when interpolating,
/// each estimated pose with the truth interpolated at its stamp). In order of time.
std::vector<PosePair> associate(const Trajectory& truth, const Trajectory& estimate,
                                const TrajectoryErrorParams& params);

/// The similarity that moves `from` onto `to` with the least squared distance (Umeyama 1991, eqs. 40-42;
/// kYaw: rotation about z only; kNone: identity). At least one point; as many in both.
SimilarityTransform align_points(std::span<const Vec3> from, std::span<const Vec3> to,
                                 TrajectoryAlignment kind);

/// The error of the motion over each span of `delta` units that begins at a pair (Sturm et al. 2012, eq. 1),
/// not divided by it. A span ends at the first pair that is at least `delta` away; one that is longer by half
/// and more, as there is a hole in the recording, is left out.
RelativeErrors relative_errors(std::span<const PosePair> pairs, RpeUnit unit, double delta);

/// Absolute and relative error of an estimated trajectory (Sturm et al. 2012, section IV).
/// An error, with the numbers, when fewer than three poses match or a scale is asked of a path that
/// does not move.
Result<TrajectoryError> evaluate_trajectory(const Trajectory& truth, const Trajectory& estimate,
                                            const TrajectoryErrorParams& params = {});

}  // namespace hm
