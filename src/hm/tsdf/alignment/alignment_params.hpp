#pragma once
#include "hm/core/params.hpp"

namespace hm {

/// How a depth image is aligned to the distance field (dissertation 4.2.8).
struct AlignmentParams {
  /// Pixels between readings in the first round.
  static constexpr int kCoarsestStride_px = 8;
  /// Pixels between readings in the last round; halved in between.
  static constexpr int kFinestStride_px = 4;
  /// A reading is the mean of those up to so many pixels away.
  static constexpr int kSmoothing_px = 2;
  /// Readings nearer to each other than this count as one observation.
  static constexpr int kIndependent_px = 8;
  int max_iterations = 10;
  /// Readings farther than this from the surface do not count.
  static constexpr double kRobustSigmasRatio = 1.5;
  /// Readings nearer than this agree with the map.
  static constexpr double kInlierSigmasRatio = 2.5;
  /// Standard deviation of the map's surface.
  static constexpr double kMapSigma_voxel = 0.2;
  double search_voxel = 8.0;
  double systematic_per_m = 0.005;
  /// Share of the readings that must see a direction for the pose to move in it.
  static constexpr double kMinObservabilityRatio = 0.002;
  double min_inlier_ratio = 0.6;
  double min_overlap_ratio = 0.25;
  double max_translation_m = 0.25;
  double max_rotation_rad = 0.2;
  double prior_shift_sigma_m = 0.01;
  double prior_turn_sigma_rad = 0.01;
  double odometry_sigmas_ratio = 8.0;
  double shared_sigma_voxel = 0.45;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"max_iterations", {1, 100}, "iterations of a round"}, self.max_iterations);
    v(ParamDoc{"search_voxel", {0, 64}, "how far along a ray the surface is sought when the pose is bad"},
      self.search_voxel);
    v(ParamDoc{"systematic_per_m",
               {0, 1},
               "error that all readings of a depth share, at 1 m, in metres; grows with its square"},
      self.systematic_per_m);
    v(ParamDoc{"min_inlier_ratio", {0, 1}, "of the readings on the map, as many must agree with it"},
      self.min_inlier_ratio);
    v(ParamDoc{"min_overlap_ratio", {0, 1}, "of the readings, as many must lie on the map"},
      self.min_overlap_ratio);
    v(ParamDoc{"max_translation_m", {0, 10}, "a larger correction of the position is not believed"},
      self.max_translation_m);
    v(ParamDoc{"max_rotation_rad", {0, 3}, "a larger correction of the orientation is not believed"},
      self.max_rotation_rad);
    v(ParamDoc{"prior_shift_sigma_m",
               {1e-6, 10},
               "a given pose's error of position since the last frame, as standard deviation an axis"},
      self.prior_shift_sigma_m);
    v(ParamDoc{"prior_turn_sigma_rad", {1e-6, 3}, "and its error of orientation"}, self.prior_turn_sigma_rad);
    v(ParamDoc{"odometry_sigmas_ratio",
               {0, 100},
               "uncertainty of odometry's poses, times what odometry gives; 0 ignores odometry"},
      self.odometry_sigmas_ratio);
    v(ParamDoc{"shared_sigma_voxel",
               {0, 10},
               "error that all readings of a scan share with the map, as standard deviation of a shift"},
      self.shared_sigma_voxel);
  }
};

}  // namespace hm
