#pragma once
#include <string>
#include <vector>

#include "hm/odometry/interface/visual_odometry.hpp"
#include "hm/odometry/tracker/tracker_matching.hpp"
#include "hm/odometry/tracker/tracker_registration.hpp"

namespace hm {

/// Search for landmarks, and the conditions that an accepted pose fulfils.
struct AttemptParams {
  MatchingParams matching;
  RegistrationParams registration;
  int min_inliers = 15;
  double max_sigma_m = 0.05;  ///< of the position, in its least certain direction
  /// These parameters with a wider search, for a guess that may be many pixels off.
  [[nodiscard]] AttemptParams widened() const;
};

/// A frame registered to the model, and why it is not accepted (empty: it is).
struct Attempt {
  Registration registration;
  std::vector<LandmarkMatch> matches;
  std::vector<std::size_t> looked_for;  ///< landmarks, by index
  std::string refusal;
};

/// Looks for the model's landmarks around where the guess puts them and registers the frame. When few are
/// found the guess may have been off (bars in front of a floor, a quick turn): they are looked for once more,
/// from where the first ones put the camera. The model is only read.
Attempt attempt_pose(const LocalMap& map, const TrackerFrame& frame, const SE3& T_odom_guess,
                     const PinholeCamera& camera, const AttemptParams& params);

/// Numbers of an attempt.
void note(const Attempt& attempt, TrackingNumbers& numbers);

/// The covariance of the pose (left perturbation in odom): that of the registration, and that of the
/// keyframes in which its landmarks were first seen.
Mat6 covariance_of(const LocalMap& map, const Attempt& attempt);

}  // namespace hm
