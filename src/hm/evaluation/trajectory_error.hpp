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

/// Alignment of the estimate to the truth before comparison: none, rigid (Umeyama 1991), similarity, or
/// translation and rotation about z (for gravity-aligned estimates).
enum class TrajectoryAlignment { kNone, kSe3, kSim3, kYaw };
inline constexpr std::array<std::string_view, 4> kTrajectoryAlignmentNames{"none", "se3", "sim3", "yaw"};

/// Association of a true pose with an estimated one: the nearest in time, or interpolated between its two
/// neighbours.
enum class TrajectoryAssociation { kNearest, kInterpolate };
inline constexpr std::array<std::string_view, 2> kTrajectoryAssociationNames{"nearest", "interpolate"};

/// Unit of the relative error's span (delta): matched poses, seconds, or metres of the true path.
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
    v(ParamDoc{"max_stamp_difference_s", {0, 10}, "largest time difference of two associated poses"},
      self.max_stamp_difference_s);
    v(ParamDoc{"association", {}, "association of true poses: nearest in time or interpolated"},
      self.association, kTrajectoryAssociationNames);
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
  Summary position_m;         ///< absolute trajectory error (ATE); usually reported as rmse
  Summary rotation_rad;       ///< angle between true and aligned estimated orientation
  RelativeErrors relative;    ///< over the span set in the parameters
  RelativeErrors per_frame;   ///< from each matched pose to the next
  RelativeErrors per_second;  ///< over one second
  RelativeErrors per_metre;   ///< over one metre of the true path; empty when it is shorter
  std::size_t pairs = 0;
  double truth_path_m = 0;  ///< length of the true path through the pairs
  SimilarityTransform alignment;
  /// True when the positions lie on a line or a point and do not determine the alignment's rotation: position
  /// errors are valid, rotation_rad is not meaningful.
  bool alignment_degenerate = false;
  std::vector<PosePair> matched;          ///< estimate already aligned
  std::vector<double> position_errors_m;  ///< one per matched pair
};

/// Pairs the poses of two trajectories by time, one to one, closest stamps first (or, when interpolating,
/// each estimated pose with the truth interpolated at its stamp). In order of time.
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

/// Absolute and relative error of an estimated trajectory (Sturm et al. 2012, section IV). Error when fewer
/// than three poses match, or when a scale is requested for a path without motion.
Result<TrajectoryError> evaluate_trajectory(const Trajectory& truth, const Trajectory& estimate,
                                            const TrajectoryErrorParams& params = {});

}  // namespace hm
