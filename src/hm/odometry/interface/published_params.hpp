#pragma once
#include <array>
#include <string_view>

#include "hm/odometry/feature/feature_params.hpp"
#include "hm/odometry/registration/ransac_params.hpp"

namespace hm {

/// Motion constraint of the published pipeline; the z axis of `odom` must point up.
enum class MotionConstraint { kNone, kRollPitch, kRollPitchHeight };
inline constexpr std::array<std::string_view, 3> kMotionConstraintNames{"none", "roll_pitch",
                                                                        "roll_pitch_height"};

/// Feature parameters of the published pipeline: 400 good features with depth, upright ORB descriptors, and
/// Khoshelham's Kinect noise model.
inline FeatureParams published_features() {
  FeatureParams features;
  features.detector = CornerDetector::kShiTomasi;
  features.max_features = 400;
  features.quality_ratio = 0.01;
  features.min_distance_px = 1;
  features.subpixel = false;
  features.oriented = false;
  features.depth_model = DepthModel::kMixture;
  features.depth_noise = {0.001425, 0, 0};
  return features;
}

/// ICP of a frame's features against the model, as published (Besl and McKay 1992; dissertation 3.2). The
/// convergence limits are those of the published code, a tenth of the "1 mm, 1 degree" in its comments.
struct ModelIcpParams {
  /// ICP: maximum number of iterations.
  static constexpr int kMaxIcpIterations = 10;
  /// ICP: maximum distance of paired points.
  static constexpr double kMaxPairDistance_m = 0.15;
  /// ICP: minimum number of pairs.
  static constexpr int kMinPairs = 15;
  /// ICP: converged when a step's translation and rotation are below these limits.
  static constexpr double kConverged_m = 1e-4;
  /// See kConverged_m.
  static constexpr double kConverged_rad = 1.7e-3;
};

struct PointModelParams {
  /// Maximum number of model points; the oldest are replaced.
  int max_model_points = 3000;
  /// Number of nearest model points considered for association.
  static constexpr int kAssociationNeighbours = 4;
  /// Largest Mahalanobis distance of an associated point.
  static constexpr double kAssociationGateRatio = 10;
  /// Lower limit of the standard deviation of a model point.
  static constexpr double kLeastSigma_m = 0.002;
};

/// Parameters of the dissertation's pipeline with the values of the published code; section
/// `odometry_published`.
struct PublishedParams {
  FeatureParams features = published_features();  ///< fixed, as published
  /// Descriptor matching: ratio of best to second best distance.
  static constexpr double kMaxMatchRatio = 0.8;
  RansacParams ransac;
  ModelIcpParams icp;
  PointModelParams model;
  MotionConstraint constraint = MotionConstraint::kNone;
  /// Number of lost frames after which a new submap starts.
  int max_lost_frames = 30;
  /// Maximum number of keyframes for relocalisation; the oldest are dropped.
  static constexpr int kMaxKeyframes = 60;
  /// Translation that triggers a new keyframe.
  static constexpr double kKeyframeDistance_m = 0.10;
  /// Rotation that triggers a new keyframe: 10 degrees.
  static constexpr double kKeyframeAngle_rad = 0.1745;
  /// Seed of RANSAC's random samples.
  static constexpr int kSeed = 1;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    RansacParams::visit(self.ransac, v);
    v(ParamDoc{"constraint", {}, "excluded motion; odom's z axis must point up"}, self.constraint,
      kMotionConstraintNames);
  }
};

}  // namespace hm
