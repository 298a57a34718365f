#pragma once
#include "hm/core/params.hpp"

namespace hm {

/// How a depth image is aligned to the distance field (dissertation 4.2.8).
struct AlignmentParams {
  int coarsest_stride_px = 8;
  int finest_stride_px = 4;
  int smoothing_px = 2;
  int independent_px = 8;
  int max_iterations = 10;
  double robust_sigmas_ratio = 1.5;
  double inlier_sigmas_ratio = 2.5;
  double map_sigma_voxel = 0.2;
  double search_voxel = 8.0;
  double systematic_per_m = 0.005;
  double min_observability_ratio = 0.002;
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
    v(ParamDoc{"coarsest_stride_px", {1, 64}, "pixels between readings in the first round"},
      self.coarsest_stride_px);
    v(ParamDoc{"finest_stride_px", {1, 64}, "pixels between readings in the last round; halved in between"},
      self.finest_stride_px);
    v(ParamDoc{"smoothing_px", {0, 16}, "a reading is the mean of those up to so many pixels away"},
      self.smoothing_px);
    v(
        ParamDoc{
            "independent_px", {1, 1000}, "readings nearer to each other than this count as one observation"},
        self.independent_px);
    v(ParamDoc{"max_iterations", {1, 100}, "iterations of a round"}, self.max_iterations);
    v(ParamDoc{"robust_sigmas_ratio", {0.5, 20}, "readings farther than this from the surface do not count"},
      self.robust_sigmas_ratio);
    v(ParamDoc{"inlier_sigmas_ratio", {0.5, 20}, "readings nearer than this agree with the map"},
      self.inlier_sigmas_ratio);
    v(ParamDoc{"map_sigma_voxel", {0, 2}, "standard deviation of the map's surface"}, self.map_sigma_voxel);
    v(ParamDoc{"search_voxel", {0, 64}, "how far along a ray the surface is sought when the pose is bad"},
      self.search_voxel);
    v(ParamDoc{"systematic_per_m",
               {0, 1},
               "error that all readings of a depth share, at 1 m, in metres; grows with its square"},
      self.systematic_per_m);
    v(ParamDoc{"min_observability_ratio",
               {0, 1},
               "share of the readings that must see a direction for the pose to move in it"},
      self.min_observability_ratio);
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
