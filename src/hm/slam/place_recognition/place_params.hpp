#pragma once
#include "hm/core/params.hpp"

namespace hm {

/// Parameters of the candidate search by feature descriptors (dissertation 3.3.2).
struct PlaceSearchParams {
  int candidates = 10;
  /// Nearest descriptors that vote, per feature (k).
  int neighbours = 4;
  /// Maximum descriptor distance for votes and matches.
  static constexpr int kMaxDescriptorBits = 64;
  /// Minimum number of votes of a candidate.
  static constexpr int kMinVotes = 4;
  /// Nearer keyframes of a submap are no loop.
  int min_keyframes_apart = 2;
  /// Descriptors compared per feature: more finds more, slower.
  int max_checks = 512;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"candidates", {1, 100000}, "keyframes that are verified at most (n)"}, self.candidates);
  }
};

/// Parameters of the geometric verification of two keyframes (dissertation 3.3.1).
struct PlaceVerifierParams {
  /// Maximum descriptor distance of a match.
  static constexpr int kMaxMatchBits = 64;
  /// Maximum ratio of a match's descriptor distance to the second best.
  static constexpr double kMatchRatio = 0.85;
  /// Samples of RANSAC at most.
  static constexpr int kMaxIterations = 500;
  /// Confidence at which RANSAC ends.
  static constexpr double kConfidenceRatio = 0.99;
  /// Maximum squared Mahalanobis distance of an inlier (chi-squared, 3 degrees of freedom, 99 %).
  static constexpr double kMaxMatchChi2 = 11.34;
  /// Maximum distance of an inlier, regardless of its uncertainty.
  static constexpr double kMaxMatchDistance_m = 0.15;
  int min_inliers = 30;
  /// Minimum number of descriptor matches consistent with the motion (seeds of the guided matching).
  static constexpr int kMinSeeds = 8;
  /// Minimum share of seed matches among all descriptor matches.
  static constexpr double kMinSeedRatio = 0.2;
  /// Maximum descriptor distance of a guided match.
  static constexpr int kMaxGuidedBits = 80;
  double rival_ratio = 0.6;
  /// Maximum conflict_ratio() of an accepted motion.
  static constexpr double kMaxConflictRatio = 0.1;
  /// Added to a registration: what it does not know of itself.
  double sigma_floor_m = 0.003;
  /// Added to a registration.
  double sigma_floor_rad = 0.002;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"min_inliers", {4, 100000}, "matches that agree once the motion guides the search for them"},
      self.min_inliers);
    v(ParamDoc{"rival_ratio",
               {0, 1},
               "no answer when another motion explains this part of the inliers with other matches"},
      self.rival_ratio);
  }
};

}  // namespace hm
