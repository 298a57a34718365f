#pragma once
#include <optional>

#include "hm/core/time.hpp"
#include "hm/odometry/feature/feature.hpp"

namespace hm {

/// Observation of a landmark of the odometry's model in a keyframe.
struct LandmarkObservation {
  std::uint64_t landmark = 0;  ///< id, shared by all keyframes that observe this point; 0: none
  Vec2 pixel = Vec2::Zero();
  Eigen::Matrix2d pixel_covariance = Eigen::Matrix2d::Identity();
  double depth_m = 0;  ///< depth reading; 0: none
  double depth_variance_m2 = 0;

  template <class Archive>
  void visit_state(Archive& archive) {
    archive(landmark, pixel, pixel_covariance, depth_m, depth_variance_m2);
  }
};

/// Observations of a keyframe with depths fused over the frames up to the next keyframe.
struct RefinedObservations {
  std::size_t frame_index = 0;  ///< of that keyframe
  std::vector<LandmarkObservation> observations;

  template <class Archive>
  void visit_state(Archive& archive) {
    archive(frame_index, observations);
  }
};

/// Where landmarks end a stretch that was tracked by depth alone, whose keyframes may have drifted.
struct EndOfDrift {
  SE3 T_odom_arrived;                      ///< this keyframe's pose as that stretch leads to it
  Mat6 arrived_covariance = Mat6::Zero();  ///< of the motion since the previous keyframe by that stretch
  std::size_t known_frame = 0;             ///< index of the earlier keyframe that shows most of the landmarks
  SE3 T_known_camera;                      ///< motion since then

  template <class Archive>
  void visit_state(Archive& archive) {
    archive(T_odom_arrived, arrived_covariance, known_frame, T_known_camera);
  }
};

/// Keyframe for relocalisation, place recognition, bundle adjustment and maps (dissertation 3.3). Its images
/// are not stored; `frame_index` refers to the recording.
struct Keyframe {
  std::size_t frame_index = 0;
  Time stamp;
  int submap = 0;       ///< a new one starts when tracking is lost and relocalisation fails
  SE3 T_odom_camera;    ///< pose in the model; TrackedFrame::T_odom_camera is filtered
  FeatureSet features;  ///< all features of the frame with descriptors, also those without depth
  /// Covariance of the motion since the previous keyframe (with `end_of_drift`: since its known one), as a
  /// perturbation [dt; dw] in this camera's frame; zero: unknown.
  Mat6 motion_covariance = Mat6::Zero();
  /// Observed landmarks; empty for methods without landmarks.
  std::vector<LandmarkObservation> observations;
  std::optional<RefinedObservations> before = {};  ///< of the previous keyframe in the same submap
  std::optional<EndOfDrift> end_of_drift = {};

  /// All of it: a saved run continues with its keyframes (StateBytes).
  template <class Archive>
  void visit_state(Archive& archive) {
    archive(frame_index, stamp, submap, T_odom_camera, features, motion_covariance, observations, before,
            end_of_drift);
  }
};

}  // namespace hm
