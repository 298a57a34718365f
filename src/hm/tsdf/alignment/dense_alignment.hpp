#pragma once
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "hm/geometry/camera.hpp"
#include "hm/geometry/se3.hpp"
#include "hm/sensors/rgbd_frame.hpp"
#include "hm/tsdf/alignment/alignment_params.hpp"
#include "hm/tsdf/tsdf_params.hpp"

namespace hm {

class VolumeGrid;

enum class AlignmentStatus {
  kAccepted,           ///< the pose fits the scan at least as well as the prior and agrees with the map
  kUnusable,           ///< the scan or the prior pose is unusable
  kTooLittleOverlap,   ///< too few readings lie on the map
  kTooLittleGeometry,  ///< no direction of motion is observable
  kRejected,           ///< the found pose does not fit well enough, or is too far from the prior
};
std::string_view to_string(AlignmentStatus status);

/// Prior of the camera pose.
struct AlignmentPrior {
  SE3 T_world_camera;
  /// Inverse covariance of [translation; rotation] of a left perturbation exp(xi) T_world_camera, in the
  /// world frame (as TrackedFrame::covariance is); zero when its error is unknown.
  Mat6 information = Mat6::Zero();
  /// Alternative start pose, used if the scan agrees better with the map there.
  std::optional<SE3> T_world_start = std::nullopt;
};

/// Prior with independent errors of position and orientation, equal on all axes: prior_shift_sigma_m and
/// prior_turn_sigma_rad of the parameters.
AlignmentPrior prior_of_given_pose(const AlignmentParams& params, const SE3& T_world_camera);

/// Quality of the fit of a scan at a pose.
struct AlignmentFit {
  double rms_m = 0;          ///< distance from the map's surface, of the inliers
  double cost = 0;           ///< weighted mean robust cost of the readings, between 0 and 1
  double overlap_ratio = 0;  ///< share of readings close enough to the map's surface to be compared
  double inlier_ratio = 0;   ///< share of inliers among those
};

struct AlignmentResult {
  AlignmentStatus status = AlignmentStatus::kUnusable;
  std::string reason;   ///< explanation, unless accepted
  SE3 T_world_camera;   ///< the prior unless accepted
  SE3 T_world_found;    ///< the found pose, whether accepted or not
  AlignmentFit before;  ///< of the prior
  AlignmentFit after;   ///< of the found pose
  /// Information of the geometry alone in each direction, as a share of the readings, ascending (a wall seen
  /// frontally: about one third for one shift and two turns each, 0 for the rest). Turns are about the
  /// readings' centroid, in units of the readings' typical distance from it.
  Vec6 observability = Vec6::Zero();
  Mat6 directions = Mat6::Zero();   ///< as columns, [shift; turn] in world axes
  int unobservable_directions = 6;  ///< number of directions in which the pose stays at the prior
  /// Covariance of [translation; rotation] of a left perturbation of T_world_camera in the world frame.
  /// Directions constrained by neither prior nor geometry have variance 1.
  Mat6 covariance = Mat6::Zero();
  std::size_t readings = 0;  ///< used in the last round
  int iterations = 0;        ///< of all rounds
  bool searched = false;     ///< surfaces were first searched along rays, since the prior was far off
  double milliseconds = 0;
};

/// Gradient-based dense alignment of depth images to a distance field (dissertation 4.2.8): Gauss-Newton on
/// the trilinear distance and its gradient, robust, coarse to fine in pixel stride; unobservable directions
/// (a single plane, a corridor's axis) stay at the prior. Does not change the grid except for unpacking
/// volumes. Single-threaded and not thread safe; bit-identical on every instruction set.
class DenseAligner {
 public:
  /// `camera` must have no lens distortion; `tsdf` must be the parameters of the grids.
  DenseAligner(const AlignmentParams& params, const TsdfParams& tsdf, const DepthNoise& noise,
               const PinholeCamera& camera);
  ~DenseAligner();
  DenseAligner(DenseAligner&&) noexcept;
  DenseAligner& operator=(DenseAligner&&) noexcept;

  AlignmentResult align(const VolumeGrid& grid, const DepthImage& depth, const AlignmentPrior& prior);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
