#pragma once
#include <optional>

#include "hm/core/time.hpp"
#include "hm/odometry/feature/feature.hpp"

namespace hm {

/// Observation of a landmark of odometry's model in a keyframe.
struct LandmarkObservation {
  std::uint64_t landmark = 0;  ///< the same number is the same point in other keyframes; 0 is none
  Vec2 pixel = Vec2::Zero();
  Eigen::Matrix2d pixel_covariance = Eigen::Matrix2d::Identity();
  double depth_m = 0;  ///< read there; 0: none
  double depth_variance_m2 = 0;
};

/// The observations of a keyframe with the depths that the frames up to the next keyframe have measured.
struct RefinedObservations {
  std::size_t frame_index = 0;  ///< of that keyframe
  std::vector<LandmarkObservation> observations;
};

/// A frame that later ones refer to: for relocalisation, place recognition, bundle adjustment and maps
/// (dissertation 3.3). Pictures are not kept: `frame_index` finds them in the recording.
struct Keyframe {
  std::size_t frame_index = 0;
  Time stamp;
  int submap = 0;       ///< a new one begins where tracking was lost and found no place again
  SE3 T_odom_camera;    ///< the model's; TrackedFrame::T_odom_camera follows it smoothly
  FeatureSet features;  ///< all of the frame, with descriptors; those without depth too
  /// Of the motion since the keyframe before, by a move [dt; dw] in this camera's frame; zero: not known.
  Mat6 motion_covariance = Mat6::Zero();
  /// Where the model was found; empty for methods that do not keep it.
  std::vector<LandmarkObservation> observations;
  std::optional<RefinedObservations> before = {};  ///< of the keyframe before, of the same submap
};

}  // namespace hm
