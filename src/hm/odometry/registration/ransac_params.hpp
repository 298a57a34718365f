#pragma once
#include <array>
#include <string_view>

#include "hm/core/params.hpp"

namespace hm {

/// Inlier test of a pair: distance at most `max_distance_m` (as published), or additionally a chi-squared
/// test of the Mahalanobis distance.
enum class InlierTest { kDistance, kMahalanobis };
inline constexpr std::array<std::string_view, 2> kInlierTestNames{"distance", "mahalanobis"};

struct RansacParams {
  /// RANSAC: maximum number of samples of three pairs.
  int max_iterations = 200;
  /// RANSAC: confidence for adaptive termination.
  static constexpr double kConfidenceRatio = 0.999;
  InlierTest inlier_test = InlierTest::kDistance;
  /// RANSAC: largest distance between the points of an inlier pair.
  double max_distance_m = 0.03;
  /// RANSAC, mahalanobis: largest squared Mahalanobis distance.
  static constexpr double kMaxChi2 = 11.34;
  /// RANSAC: minimum number of inlier pairs.
  int min_inliers = 30;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"inlier_test", {}, "RANSAC: inlier test of a pair"}, self.inlier_test, kInlierTestNames);
  }
};

}  // namespace hm
