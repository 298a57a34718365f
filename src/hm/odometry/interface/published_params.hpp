#pragma once
#include <array>
#include <string_view>

#include "hm/odometry/feature/feature_params.hpp"
#include "hm/odometry/registration/ransac_params.hpp"

namespace hm {

/// What the published pipeline may take for known of a motion, in an `odom` whose z axis points up.
enum class MotionConstraint { kNone, kRollPitch, kRollPitchHeight };
inline constexpr std::array<std::string_view, 3> kMotionConstraintNames{"none", "roll_pitch",
                                                                        "roll_pitch_height"};

/// The detector of the published pipeline: 400 good features where there is depth, upright ORB descriptors,
/// and Khoshelham's noise of the Kinect.
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

/// Iterative closest point of a frame's features against the model, as published (Besl and McKay 1992;
/// dissertation 3.2). The limits of the published code were commented as "1 mm, 1 degree" and were a tenth.
struct ModelIcpParams {
  /// ICP: steps at most.
  static constexpr int kMaxIcpIterations = 10;
  /// ICP: farther model points are not paired.
  static constexpr double kMaxPairDistance_m = 0.15;
  /// ICP: fewer pairs are a failure.
  static constexpr int kMinPairs = 15;
  /// ICP: ends when a step moves less than this, metres, and turns less than kConverged_rad.
  static constexpr double kConverged_m = 1e-4;
  /// ICP: ends when a step turns less than this, radians, and moves less than kConverged_m.
  static constexpr double kConverged_rad = 1.7e-3;
};

struct PointModelParams {
  int max_model_points = 3000;
  /// Model points tried for each new one.
  static constexpr int kAssociationNeighbours = 4;
  /// Mahalanobis distance up to which a point is seen again.
  static constexpr double kAssociationGateRatio = 10;
  /// A model point never gets more certain than this.
  static constexpr double kLeastSigma_m = 0.002;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"max_model_points", {10, 1e6}, "the model's size; then the oldest points make room"},
      self.max_model_points);
  }
};

/// Parameters of the dissertation's pipeline with the values of the published code; section
/// `odometry_published`.
struct PublishedParams {
  FeatureParams features = published_features();  ///< as published: no parameters of their own
  /// Descriptors: best to second best distance.
  static constexpr double kMaxMatchRatio = 0.8;
  RansacParams ransac;
  ModelIcpParams icp;
  PointModelParams model;
  MotionConstraint constraint = MotionConstraint::kNone;
  int max_lost_frames = 30;
  int max_keyframes = 60;
  double keyframe_distance_m = 0.10;
  double keyframe_angle_rad = 0.1745;
  int seed = 1;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    RansacParams::visit(self.ransac, v);
    PointModelParams::visit(self.model, v);
    v(ParamDoc{"constraint", {}, "motion that is taken for impossible; odom's z axis must point up"},
      self.constraint, kMotionConstraintNames);
    v(ParamDoc{"max_lost_frames", {1, 1e6}, "lost for longer: a new submap begins"}, self.max_lost_frames);
    v(ParamDoc{"max_keyframes", {1, 10000}, "keyframes kept to be found again at; the oldest go first"},
      self.max_keyframes);
    v(ParamDoc{"keyframe_distance_m", {0, 100}, "a keyframe after this much motion"},
      self.keyframe_distance_m);
    v(ParamDoc{"keyframe_angle_rad", {0, 3.2}, "or after this much turning"}, self.keyframe_angle_rad);
    v(ParamDoc{"seed", {0, 2147483647}, "of RANSAC's samples"}, self.seed);
  }
};

}  // namespace hm
