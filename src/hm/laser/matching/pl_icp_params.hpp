#pragma once
#include "hm/core/params.hpp"

namespace hm {

/// Parameters of the scan matcher. `PlIcpParams::dissertation()` is the original PL-ICP of 2.2.1.
struct PlIcpParams {
  int max_iterations = 10;
  /// Converged when an iteration moves less than this and epsilon_angle_rad.
  double epsilon_xy_m = 1e-4;
  /// See epsilon_xy_m.
  double epsilon_angle_rad = 2e-5;
  /// Maximum distance of paired points.
  static constexpr double kMaxCorrespondenceDistance_m = 0.3;
  /// A result further from the guess is rejected.
  double max_linear_correction_m = 0.5;
  /// A result rotated further from the guess is rejected.
  static constexpr double kMaxAngularCorrection_rad = 0.785;
  /// Largest share of the pairs that is kept, nearest first.
  double keep_percentile_ratio = 0.95;
  /// Pairs beyond this multiple of the 0.7 quantile of the distances are rejected.
  double adaptive_multiple = 2.5;
  /// Quantile of the distances for the adaptive limit.
  static constexpr double kAdaptiveOrderRatio = 0.7;
  /// Keeps only the nearest of several points paired with one reference point.
  bool remove_duplicates = true;
  /// A match with fewer pairs than this share of the smaller scan is rejected.
  double min_pairs_ratio = 0.05;
  /// Minimum number of pairs.
  static constexpr int kMinPairs = 10;
  /// Half length of the neighbourhood that a reference line is fitted to; 0: line through the two nearest
  /// points.
  double line_half_length_m = 0.3;
  double range_sigma_m = 0;
  /// Weight pairs by incidence angle: the range noise of a grazing beam moves its point mostly along the
  /// wall.
  bool weight_by_incidence = true;
  /// The first iterations use every n-th point; 1: all.
  int coarse_stride = 4;
  /// A direction constrained by less than this share of the pairs is free.
  double min_information_ratio = 0.005;
  /// A direction is free unless its information is this many times that expected from noise of the normals.
  double information_over_noise = 5;
  /// Compute the covariance of every match.
  bool compute_covariance = true;

  /// The matcher as published: lines through the two nearest points, every beam in every iteration, no
  /// weights, as in Censi (ICRA 2008) with the defaults of the author's package.
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
    v(ParamDoc{"max_iterations", {1, 1000}, "maximum number of iterations"}, self.max_iterations);
    v(ParamDoc{"range_sigma_m", {0, 1}, "standard deviation of a range; 0: estimated from each scan"},
      self.range_sigma_m);
  }
};

}  // namespace hm
