#pragma once
#include "hm/core/params.hpp"
#include "hm/slam/place_recognition/place_params.hpp"
#include "hm/slam/pose_graph/pose_graph_2d_solver.hpp"

namespace hm {

/// Global alignment of RGB-D keyframes (dissertation 3.3).
struct RgbdLoopParams {
  bool enabled = true;
  PlaceSearchParams search;
  PlaceVerifierParams verifier;
  /// Number of new loops after which the graph is optimised.
  static constexpr int kLoopsPerSolution = 4;
  bool bundle_adjustment = true;
  bool match_covisible = true;
  /// Bundle adjustment is refused where surfaces of different visits disagree by more than this factor
  /// (SurfaceAgreement::cost), against poses of the graph with surface factors. fr1/xyz and fr1/rpy, whose
  /// features agree with depth, have 1.17 to 1.24; 7-Scenes, whose colour was registered by its images, 1.58
  /// and 1.59 (whole recordings, with and without slam.align).
  static constexpr double kMaxSurfaceCostRatio = 1.4;
  /// ... and by this much more: smaller differences are within the noise of depth (of two exact surfaces with
  /// normal noise the cost is 0.17; the refused adjustments of these recordings lose 0.3).
  static constexpr double kMinSurfaceCostGain = 0.1;
  // Standard deviation of odometry between successive keyframes where it states no covariance: a constant
  // part and one that grows with the translation between them (odometry_covariance).
  /// Constant part of the translation's deviation, metres.
  static constexpr double kOdometrySigma_m = 0.003;
  /// Constant part of the rotation's deviation, radians.
  static constexpr double kOdometrySigma_rad = 0.002;
  /// Part of the translation's deviation that grows with the translation.
  static constexpr double kOdometryDriftRatio = 0.01;
  /// Part of the rotation's deviation that grows with the translation, radians a metre.
  static constexpr double kOdometryDrift_rad_m = 0.004;
  // Where odometry states a covariance, the squares of these deviations are added to it: a floor.
  /// Constant part of the translation's, metres.
  static constexpr double kOdometryFloor_m = 0.0003;
  /// Part of the translation's that grows with the translation, metres a metre.
  static constexpr double kOdometryFloorRatio = 0.001;
  /// Constant part of the rotation's, radians.
  static constexpr double kOdometryFloor_rad = 0.0002;
  /// Part of the rotation's that grows with the translation, radians a metre.
  static constexpr double kOdometryFloor_rad_m = 0.0004;
  /// Squared Mahalanobis distance between a loop and the pose graph beyond which the loop is rejected: about
  /// the 0.999 quantile of chi-squared with 6 degrees of freedom.
  static constexpr double kGateChi2 = 22.5;
  /// Systematic translation drift that this gate allows besides the graph's covariance, metres a metre of
  /// path.
  static constexpr double kGateDriftRatio = 0.02;
  /// Systematic rotation drift that this gate allows besides the graph's covariance, radians a metre of path.
  static constexpr double kGateDrift_rad_m = 0.003;
  /// A loop is rejected if another place explains this share of its features.
  static constexpr double kRivalRatio = 0.6;
  /// A loop that moves its keyframe by more than this, metres, must be confirmed by a loop of another
  /// keyframe.
  static constexpr double kLargeCorrection_m = 0.3;
  /// A loop that turns its keyframe by more than this, radians, must be confirmed by a loop of another
  /// keyframe.
  static constexpr double kLargeCorrection_rad = 0.1;
  /// A loop that is not confirmed within so many keyframes is dropped.
  static constexpr int kMaxWaitingKeyframes = 30;
  /// A loop becomes an edge when the graph's variance of its motion is larger by this factor.
  static constexpr double kMinInformationGainRatio = 1;
  /// Loops that disagree more with the solved graph are taken out.
  static constexpr double kMaxLoopChi2 = 40;
  PoseGraphSolverParams solver{50, 9};

  /// Own parameters only; search, verifier and solver are sections of their own, since some names are the
  /// same.
  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"enabled", {}, "look for places seen before", ParamLevel::kBasic}, self.enabled);
    v(ParamDoc{"bundle_adjustment",
               {},
               "at the end, adjust keyframes and their features together",
               ParamLevel::kBasic},
      self.bundle_adjustment);
    v(ParamDoc{"match_covisible",
               {},
               "before they are adjusted, match features of all keyframes that see the same place",
               ParamLevel::kBasic},
      self.match_covisible);
  }
};

}  // namespace hm
