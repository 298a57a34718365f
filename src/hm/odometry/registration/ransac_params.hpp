#pragma once
#include <array>
#include <string_view>

#include "hm/core/params.hpp"

namespace hm {

/// When a pair agrees with a motion: its points are `max_distance_m` apart at most (as published), or their
/// Mahalanobis distance passes the chi-squared test too.
enum class InlierTest { kDistance, kMahalanobis };
inline constexpr std::array<std::string_view, 2> kInlierTestNames{"distance", "mahalanobis"};

struct RansacParams {
  int max_iterations = 200;
  /// RANSAC: ends when a better sample is this unlikely.
  static constexpr double kConfidenceRatio = 0.999;
  InlierTest inlier_test = InlierTest::kDistance;
  double max_distance_m = 0.03;
  /// RANSAC, mahalanobis: squared distance in standard deviations.
  static constexpr double kMaxChi2 = 11.34;
  int min_inliers = 30;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"max_iterations", {1, 1e6}, "RANSAC: samples of three pairs at most"}, self.max_iterations);
    v(ParamDoc{"inlier_test", {}, "RANSAC: what makes a pair agree"}, self.inlier_test, kInlierTestNames);
    v(ParamDoc{"max_distance_m", {1e-4, 100}, "RANSAC: points of an agreeing pair are not farther apart"},
      self.max_distance_m);
    v(ParamDoc{"min_inliers", {3, 1e6}, "RANSAC: agreeing pairs that an answer needs"}, self.min_inliers);
  }
};

}  // namespace hm
