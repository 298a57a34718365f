#pragma once
#include <vector>

#include "hm/odometry/feature/feature_detection.hpp"
#include "hm/odometry/tracker/tracker_registration.hpp"

namespace hm {

/// What a keyframe is made of.
struct KeyframeParts {
  const TrackerFrame* frame = nullptr;
  FeatureSet features;
  std::vector<LandmarkMatch> matches;  ///< its inliers become sightings
  SE3 T_odom_camera;
  Mat6 covariance = Mat6::Zero();         ///< left perturbation in odom
  Mat6 motion_covariance = Mat6::Zero();  ///< as in Keyframe
  int submap = 0;
};

/// Adds the frame to the model as a keyframe: what was found there is sighted again, and features with depth
/// that lie apart from them become landmarks, up to `target_landmarks`. Returns the keyframe's record.
std::shared_ptr<Keyframe> insert_keyframe(LocalMap& map, KeyframeParts parts, const PinholeCamera& camera,
                                          const RegistrationParams& params, std::size_t target_landmarks);

/// Readings of a frame that is no keyframe, fused into what the newest keyframe knows of the depth of the
/// landmarks they share (inverse variances; the deviation does not sink below a share of a single reading's,
/// because errors of a depth camera last).
void fuse_depths(LocalMap& map, const std::vector<LandmarkMatch>& matches, const SE3& T_odom_camera,
                 const PinholeCamera& camera, const DepthNoise& noise);

/// The median depth of the features that have one; nothing without any.
std::optional<double> median_depth_m(const FeatureSet& features);

}  // namespace hm
