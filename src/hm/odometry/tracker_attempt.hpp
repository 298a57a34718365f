#pragma once
#include <string>
#include <vector>

#include "hm/odometry/tracker_matching.hpp"
#include "hm/odometry/tracker_registration.hpp"
#include "hm/odometry/visual_odometry.hpp"

namespace hm {

/// A registration that was looked at, and why it is not accepted (empty: it is).
struct Attempt {
  Registration registration;
  std::vector<LandmarkMatch> matches;
  std::vector<std::size_t> looked_for;
  std::string refusal;
};

/// How a frame is registered and what is asked of the answer.
struct AttemptParams {
  MatchingParams matching;
  RegistrationParams registration;
  int min_inliers = 15;
  double lost_sigma_m = 0.05;
  /// The same for a guess that may be some pixels off.
  [[nodiscard]] AttemptParams widened() const;
};

/// Looks for the model's landmarks where the guess puts them, registers the frame to what was found and
/// judges the result. Nothing is written to the model.
Attempt attempt_at(const LocalMap& map, const TrackerFrame& frame, const SE3& T_odom_camera_guess,
                   const PinholeCamera& camera, const AttemptParams& params);

/// What an attempt says about the frame.
void note(const Attempt& attempt, TrackingNumbers& numbers);

/// The covariance of the pose (left perturbation in odom): that of the registration, and that of the
/// keyframes in which its landmarks were first seen.
Mat6 covariance_of(const LocalMap& map, const Attempt& attempt);

}  // namespace hm
