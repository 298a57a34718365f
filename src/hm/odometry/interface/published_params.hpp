#pragma once
#include <array>
#include <string_view>

#include "hm/odometry/feature/feature_params.hpp"
#include "hm/odometry/published/model_registration.hpp"
#include "hm/odometry/published/point_model.hpp"
#include "hm/odometry/registration/ransac.hpp"

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

/// Parameters of the dissertation's pipeline with the values of the published code; section
/// `odometry_published`.
struct PublishedParams {
  FeatureParams features = published_features();
  double max_match_ratio = 0.8;
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
    FeatureParams::visit(self.features, v);
    v(ParamDoc{"max_match_ratio", {0.1, 2}, "descriptors: best to second best distance"},
      self.max_match_ratio);
    RansacParams::visit(self.ransac, v);
    ModelIcpParams::visit(self.icp, v);
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
