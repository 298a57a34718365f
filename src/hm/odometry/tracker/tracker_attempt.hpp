#pragma once
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hm/odometry/interface/odometry_params.hpp"
#include "hm/odometry/interface/visual_odometry.hpp"
#include "hm/odometry/registration/surface_following.hpp"
#include "hm/odometry/tracker/tracker_matching.hpp"
#include "hm/odometry/tracker/tracker_registration.hpp"

namespace hm {

/// Parameters of the search for landmarks, and conditions for accepting a pose.
struct AttemptParams {
  AttemptParams() = default;
  explicit AttemptParams(const OdometryParams& params);
  MatchingParams matching;
  RegistrationParams registration;
  int min_inliers = 15;
  double max_sigma_m = 0.05;  ///< standard deviation of the position in its least certain direction
  /// Parameters for a guess that may be wrong by many pixels.
  [[nodiscard]] AttemptParams widened() const;
  /// Parameters for an image blurred by motion: patches are matched at half the resolution.
  [[nodiscard]] AttemptParams for_blur() const;
};

/// Registration of a frame to the model, and the reason if it is not accepted (else empty).
struct Attempt {
  Registration registration;
  std::vector<LandmarkMatch> matches;
  std::vector<std::size_t> looked_for;  ///< indices of the landmarks searched for
  std::string refusal;
};

/// Searches for the model's landmarks around their predicted positions and registers the frame. When few are
/// found, since the guess was wrong (repeating structures, fast rotation), the search is repeated from the
/// registered pose; when the pose is refused, with patches for a blurred image. The model is not changed.
Attempt attempt_pose(const LocalMap& map, const TrackerFrame& frame, const SE3& T_odom_guess,
                     const PinholeCamera& camera, const AttemptParams& params);

/// Attempts the pose again from another guess, in place of an attempt that was refused: with patches for a
/// guess that may be wrong by many pixels. Also where less than half of the landmarks searched for agree:
/// something else than the room may have led there, as a person who fills part of the picture and whose
/// motion its brightness follows. Then the pose is kept with which the landmarks agree that clearly more
/// keyframes have seen: those on something that moves are in few keyframes.
void attempt_again(const LocalMap& map, const TrackerFrame& frame, const SE3& T_odom_guess,
                   const PinholeCamera& camera, const AttemptParams& params, Attempt& attempt);

/// Attempts from motions between depth images since the last pose, each a guess that may be wrong: a few
/// landmarks are sufficient where the surfaces hold the camera in all directions and agree with them.
std::optional<Attempt> attempt_by_motions(const LocalMap& map, const TrackerFrame& frame,
                                          const SE3& T_odom_last, std::span<const SurfaceMotion> motions,
                                          const PinholeCamera& camera, const AttemptParams& params);

/// With a prior, six inliers are enough where few landmarks are in view.
bool is_enough_with_prior(const Attempt& attempt);

/// Copies the statistics of an attempt to `numbers`.
void note(const Attempt& attempt, TrackingNumbers& numbers);

/// Covariance of the pose (left perturbation in odom): that of the registration plus that of the keyframes
/// that first observed its landmarks.
Mat6 covariance_of(const LocalMap& map, const Attempt& attempt);

}  // namespace hm
