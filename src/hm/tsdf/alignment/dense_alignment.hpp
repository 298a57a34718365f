#pragma once
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "hm/geometry/camera.hpp"
#include "hm/geometry/se3.hpp"
#include "hm/sensors/rgbd_frame.hpp"
#include "hm/tsdf/alignment/alignment_params.hpp"
#include "hm/tsdf/projection/tsdf_params.hpp"

namespace hm {

class VolumeGrid;

enum class AlignmentStatus {
  kAccepted,           ///< the pose explains the scan better (or as well) and agrees with the map
  kUnusable,           ///< the scan or the prior pose cannot be used
  kTooLittleOverlap,   ///< too few readings lie on the map
  kTooLittleGeometry,  ///< no direction of motion is seen
  kRejected,           ///< what was found does not explain the scan well enough, or is too far off
};
std::string_view to_string(AlignmentStatus status);

/// Where the camera is believed to be before the scan is looked at.
struct AlignmentPrior {
  SE3 T_world_camera;
  /// Inverse covariance of [translation; rotation] of a left perturbation exp(xi) T_world_camera, in the
  /// world frame (as TrackedFrame::covariance is); zero when nothing is known of its error.
  Mat6 information = Mat6::Zero();
  /// Where to begin looking, if the scan agrees with the map better there.
  std::optional<SE3> T_world_start = std::nullopt;
};

/// The prior of a camera whose position and orientation have independent errors, the same on all axes:
/// prior_shift_sigma_m and prior_turn_sigma_rad of the parameters.
AlignmentPrior prior_of_given_pose(const AlignmentParams& params, const SE3& T_world_camera);

/// How well a pose explains a scan.
struct AlignmentFit {
  double rms_m = 0;          ///< distance from the map's surface, of the readings that agree with it
  double cost = 0;           ///< mean robust cost of the readings by what they count, between 0 and 1
  double overlap_ratio = 0;  ///< readings near enough to the map's surface to be compared, of all
  double inlier_ratio = 0;   ///< readings that agree with the map, of those
};

struct AlignmentResult {
  AlignmentStatus status = AlignmentStatus::kUnusable;
  std::string reason;   ///< in words with numbers, unless accepted
  SE3 T_world_camera;   ///< the prior unless accepted
  SE3 T_world_found;    ///< what was found, whether accepted or not
  AlignmentFit before;  ///< of the prior
  AlignmentFit after;   ///< of what was found
  /// Of the geometry alone: how many readings' worth of information each direction has, as share of all (a
  /// wall seen straight on: one third of 1 each for one shift and two turns, 0 for the rest); ascending.
  /// Turns are about the readings' centroid, in units of the readings' typical distance from it.
  Vec6 observability = Vec6::Zero();
  Mat6 directions = Mat6::Zero();   ///< as columns, [shift; turn] in world axes
  int unobservable_directions = 6;  ///< in these the pose stays at the prior
  /// Of [translation; rotation] of a left perturbation of T_world_camera in the world frame. In directions
  /// that neither prior nor geometry see it is large (variance 1).
  Mat6 covariance = Mat6::Zero();
  std::size_t readings = 0;  ///< used in the last round
  int iterations = 0;        ///< of all rounds
  bool searched = false;     ///< the prior was so far off that surfaces were sought along rays first
  double milliseconds = 0;
};

/// Gradient-based dense alignment of depth images to a distance field (dissertation 4.2.8): Gauss-Newton on
/// the trilinear distance and its gradient, robust, coarse to fine in pixel stride; what the geometry cannot
/// see (a single plane, a corridor's axis) stays at the prior. Never changes the grid but for unpacking
/// volumes. Not thread safe; one thread; the same bits on every instruction set.
class DenseAligner {
 public:
  /// `camera` must have no lens distortion; `tsdf` must be what the grids are made with.
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
