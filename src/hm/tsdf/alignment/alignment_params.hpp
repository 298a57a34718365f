#pragma once
#include "hm/core/params.hpp"

namespace hm {

/// Parameters of aligning a depth image to the distance field (dissertation 4.2.8).
struct AlignmentParams {
  /// Pixel stride of the readings in the first round.
  static constexpr int kCoarsestStride_px = 8;
  /// Pixel stride of the readings in the last round; halved from round to round.
  static constexpr int kFinestStride_px = 4;
  /// Readings are averaged over neighbours up to this many pixels away.
  static constexpr int kSmoothing_px = 2;
  /// Readings closer to each other than this count as one observation.
  static constexpr int kIndependent_px = 8;
  /// Maximum number of iterations per round.
  int max_iterations = 10;
  /// Width of the robust function, in standard deviations of the distance from the surface.
  static constexpr double kRobustSigmasRatio = 1.5;
  /// Readings closer to the surface than this are inliers.
  static constexpr double kInlierSigmasRatio = 2.5;
  /// Standard deviation of the map's surface.
  static constexpr double kMapSigma_voxel = 0.2;
  double search_voxel = 8.0;
  double systematic_per_m = 0.005;
  /// Minimum share of the readings that must constrain a direction for the pose to change in it.
  static constexpr double kMinObservabilityRatio = 0.002;
  double min_inlier_ratio = 0.6;
  double min_overlap_ratio = 0.25;
  /// Larger corrections of the position are rejected.
  static constexpr double kMaxTranslation_m = 0.25;
  /// Larger corrections of the orientation are rejected.
  static constexpr double kMaxRotation_rad = 0.2;
  double prior_shift_sigma_m = 0.01;
  double prior_turn_sigma_rad = 0.01;
  double odometry_sigmas_ratio = 8.0;
  double shared_sigma_voxel = 0.45;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"search_voxel",
               {0, 64},
               "distance along a ray over which the surface is searched for when the prior pose is "
               "inaccurate; 0: no search"},
      self.search_voxel);
    v(ParamDoc{"systematic_per_m",
               {0, 1},
               "error common to all readings at a depth of 1 m; grows with the square of the depth"},
      self.systematic_per_m);
    v(ParamDoc{"min_inlier_ratio",
               {0, 1},
               "minimum share of inliers among the readings on the map; smaller accepts worse alignments"},
      self.min_inlier_ratio);
    v(ParamDoc{"min_overlap_ratio", {0, 1}, "minimum share of the readings that lie on the map"},
      self.min_overlap_ratio);
    v(ParamDoc{"prior_shift_sigma_m",
               {1e-6, 10},
               "position error of given poses from frame to frame, standard deviation per axis; larger "
               "follows the map more"},
      self.prior_shift_sigma_m);
    v(ParamDoc{"prior_turn_sigma_rad",
               {1e-6, 3},
               "orientation error of given poses from frame to frame, standard deviation per axis; larger "
               "follows the map more"},
      self.prior_turn_sigma_rad);
    v(ParamDoc{"odometry_sigmas_ratio",
               {0, 100},
               "factor on the standard deviations given by odometry; larger follows the map more; 0 ignores "
               "odometry"},
      self.odometry_sigmas_ratio);
    v(ParamDoc{"shared_sigma_voxel",
               {0, 10},
               "error common to all readings of a scan and the map, standard deviation of a shift; larger "
               "corrects less"},
      self.shared_sigma_voxel);
  }
};

}  // namespace hm
