#pragma once
#include <vector>

#include "hm/odometry/feature/feature_detection.hpp"
#include "hm/odometry/geometry_tracking/geometry_tracker.hpp"
#include "hm/odometry/inertial/inertial_window.hpp"
#include "hm/odometry/interface/odometry_params.hpp"
#include "hm/odometry/interface/visual_odometry.hpp"
#include "hm/odometry/registration/relocalisation.hpp"
#include "hm/odometry/tracker/tracker_registration.hpp"

namespace hm {

/// Parts of a new keyframe.
struct KeyframeParts {
  const TrackerFrame* frame = nullptr;
  FeatureSet features;
  std::vector<LandmarkMatch> matches;  ///< its inliers become sightings
  SE3 T_odom_camera;
  Mat6 covariance = Mat6::Zero();         ///< left perturbation in odom
  Mat6 motion_covariance = Mat6::Zero();  ///< as in Keyframe
  int submap = 0;
  /// Instead of the last keyframe's surface: the motion since then, with its covariance (perturbation in this
  /// camera's frame).
  std::optional<Mat6> covariance_since_last = {};
  std::optional<GyroTurn> turn = {};  ///< since the last keyframe
};

/// A frame becomes a keyframe when it finds much fewer landmarks than the best one since the last keyframe,
/// or has moved away from it. `depth_m`: of that keyframe's features.
bool keyframe_due(const TrackerParams& params, const SE3& T_keyframe_camera, int inliers, int best_inliers,
                  double depth_m);

/// Adds the frame to the model as a keyframe: inlier matches become sightings, and features with depth apart
/// from them become new landmarks, up to `target_landmarks`. Returns the keyframe's record.
std::shared_ptr<Keyframe> insert_keyframe(LocalMap& map, KeyframeParts parts, const PinholeCamera& camera,
                                          const RegistrationParams& params, std::size_t target_landmarks);

/// Of the newest keyframe, whose pose landmarks have found after a stretch tracked by depth: how it hangs
/// together with the keyframe that most of its sighted landmarks come from; nothing if that has left the
/// model.
std::optional<EndOfDrift> end_of_drift(const LocalMap& map, const DepthArrival& arrival,
                                       const SE3& T_odom_model);

/// The depth images of the model's keyframes, at their present poses.
std::vector<SurfaceReference> surface_references(const LocalMap& map);

/// Record of a keyframe without features, which was tracked by its depth image.
std::shared_ptr<Keyframe> make_depth_keyframe(const KeyframeParts& parts);

/// Places features of a frame at the time of its middle row. `unknown_depth_m`: of features without depth.
FeatureSet at_middle_row(FeatureSet features, const TrackerFrame& frame, const SE3& T_odom_camera,
                         const PinholeCamera& camera, const OdometryParams& params, double unknown_depth_m);

/// Replaces the velocity of the newest keyframe's camera [m/s; rad/s] and moves its sightings, and the
/// landmarks seen by it alone, to the time of its middle row accordingly.
void retime_keyframe(LocalMap& map, const InstantMotion& motion, const ColorTimes& times,
                     const PinholeCamera& camera);

/// Fuses depth readings of a non-keyframe into the depths of the newest keyframe's sightings of the same
/// landmarks (weighted by inverse variance; the standard deviation is limited from below by a share of a
/// single reading's, since depth errors are correlated over time).
void fuse_depths(LocalMap& map, const std::vector<LandmarkMatch>& matches, const SE3& T_odom_camera,
                 const PinholeCamera& camera, const DepthNoise& noise);

/// Number of features with depth.
int count_with_depth(const FeatureSet& features);

/// The model's keyframes as places to find again, newest last.
std::vector<KnownPlace> known_places(const LocalMap& map);

/// Completes a restored keyframe: its record and, from its frame, what is not saved. `with_surface`: also its
/// surface. Errors: no keyframe of the run is at its index (kCorrupted), its frame cannot be read again.
Result<void> complete_keyframe(MapKeyframe& keyframe, bool with_surface, const OdometryHistory& history,
                               const PinholeCamera& camera, const DepthNoise& noise, double max_depth_m);

/// Median depth of the features with depth; nothing if there are none.
std::optional<double> median_depth_m(const FeatureSet& features);

}  // namespace hm
