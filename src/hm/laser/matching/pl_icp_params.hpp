#pragma once
#include "hm/core/params.hpp"

namespace hm {

/// Parameters of the scan matcher. `PlIcpParams::dissertation()` gives the plain PL-ICP of 2.2.1.
struct PlIcpParams {
  int max_iterations = 10;
  /// An iteration that moves less than this and epsilon_angle_rad is the last.
  double epsilon_xy_m = 1e-4;
  /// See epsilon_xy_m.
  double epsilon_angle_rad = 2e-5;
  /// Points further apart are never paired.
  static constexpr double kMaxCorrespondenceDistance_m = 0.3;
  double max_linear_correction_m = 0.5;
  /// A result turned further from the guess is no answer.
  static constexpr double kMaxAngularCorrection_rad = 0.785;
  double keep_percentile_ratio = 0.95, adaptive_multiple = 2.5;
  /// Quantile of the distances that the adaptive limit is taken from.
  static constexpr double kAdaptiveOrderRatio = 0.7;
  bool remove_duplicates = true;
  double min_pairs_ratio = 0.05;
  /// Fewer pairs are no answer.
  static constexpr int kMinPairs = 10;
  /// Reach of the points that a reference line is fitted to; 0: through the two nearest points.
  double line_half_length_m = 0.3;
  double range_sigma_m = 0;
  /// A grazing beam's range noise moves its point along the wall: weigh it more.
  bool weight_by_incidence = true;
  /// First iterations use every n-th point; 1: all.
  int coarse_stride = 4;
  /// A direction that less than this share of the pairs constrains is free.
  double min_information_ratio = 0.02;
  /// A direction is free unless its information is this many times what noisy normals feign.
  double information_over_noise = 5;
  bool compute_covariance = true;

  /// The matcher as published: lines through the two nearest points, every beam in every iteration, no
  /// weights, the iterated program of Censi (ICRA 2008) with the defaults of the author's package.
  static PlIcpParams dissertation() {
    PlIcpParams params;
    params.epsilon_xy_m = params.epsilon_angle_rad = 1e-6;
    params.keep_percentile_ratio = 0.9;
    params.adaptive_multiple = 2.0;
    params.line_half_length_m = 0;
    params.weight_by_incidence = false;
    params.coarse_stride = 1;
    params.min_information_ratio = params.information_over_noise = 0;
    return params;
  }

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"max_iterations", {1, 1000}, "iterations at most"}, self.max_iterations);
    v(ParamDoc{"max_linear_correction_m", {1e-3, 100}, "a result further from the guess is no answer"},
      self.max_linear_correction_m);
    v(ParamDoc{"keep_percentile_ratio", {0.1, 1}, "share of the pairs, by distance, that is kept at most"},
      self.keep_percentile_ratio);
    v(ParamDoc{"adaptive_multiple", {1, 100}, "pairs beyond this many times that quantile are left out"},
      self.adaptive_multiple);
    v(
        ParamDoc{
            "remove_duplicates", {}, "of the points paired with one reference point, only near ones count"},
        self.remove_duplicates);
    v(ParamDoc{"min_pairs_ratio", {0, 1}, "fewer pairs than this share of the smaller scan are no answer"},
      self.min_pairs_ratio);
    v(ParamDoc{"range_sigma_m", {0, 1}, "standard deviation of a range; 0: estimated from each scan"},
      self.range_sigma_m);
    v(ParamDoc{"compute_covariance", {}, "covariance of every match"}, self.compute_covariance);
  }
};

}  // namespace hm
