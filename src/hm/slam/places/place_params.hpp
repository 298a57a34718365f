#pragma once
#include "hm/core/params.hpp"

namespace hm {

/// How places are recognised by their features' descriptors (dissertation 3.3.2).
struct PlaceSearchParams {
  int candidates = 10;
  int neighbours = 4;
  int max_descriptor_bits = 64;
  int min_votes = 4;
  int min_keyframes_apart = 2;
  int max_checks = 512;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"candidates", {1, 100000}, "keyframes that are verified at most (n)"}, self.candidates);
    v(ParamDoc{"neighbours", {1, 1000}, "nearest descriptors that vote, per feature (k)"}, self.neighbours);
    v(ParamDoc{"max_descriptor_bits", {0, 256}, "descriptors further apart do not vote or match"},
      self.max_descriptor_bits);
    v(ParamDoc{"min_votes", {1, 100000}, "a candidate has at least so many"}, self.min_votes);
    v(ParamDoc{"min_keyframes_apart", {1, 100000}, "nearer keyframes of a submap are no loop"},
      self.min_keyframes_apart);
    v(ParamDoc{"max_checks", {16, 1000000}, "descriptors compared per feature: more finds more, slower"},
      self.max_checks);
  }
};

/// When two keyframes show the same place.
struct PlaceVerifierParams {
  int max_match_bits = 64;
  double match_ratio = 0.85;
  int max_iterations = 500;
  double confidence_ratio = 0.99;
  double max_match_chi2 = 11.34;
  double max_match_distance_m = 0.15;
  int min_inliers = 30;
  int min_seeds = 8;
  double min_seed_ratio = 0.2;
  int max_guided_bits = 80;
  double rival_ratio = 0.6;
  double max_conflict_ratio = 0.1;
  double sigma_floor_m = 0.003, sigma_floor_rad = 0.002;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"max_match_bits", {0, 256}, "descriptors of a match differ by at most so many bits"},
      self.max_match_bits);
    v(ParamDoc{"match_ratio", {0, 1}, "a match's distance is below this part of the second best's"},
      self.match_ratio);
    v(ParamDoc{"max_iterations", {1, 1000000}, "samples of RANSAC at most"}, self.max_iterations);
    v(ParamDoc{"confidence_ratio", {0, 0.999999}, "RANSAC ends when it is so sure"}, self.confidence_ratio);
    v(ParamDoc{"max_match_chi2",
               {0, 1e6},
               "squared Mahalanobis distance of an inlier at most (3 degrees of freedom)"},
      self.max_match_chi2);
    v(ParamDoc{"max_match_distance_m", {0, 10}, "distance of an inlier at most, however uncertain it is"},
      self.max_match_distance_m);
    v(ParamDoc{"min_seeds", {4, 100000}, "matches by look that agree on a motion"}, self.min_seeds);
    v(ParamDoc{"min_seed_ratio", {0, 1}, "of all matches by look"}, self.min_seed_ratio);
    v(ParamDoc{"min_inliers", {4, 100000}, "matches that agree once the motion guides the search for them"},
      self.min_inliers);
    v(ParamDoc{"max_guided_bits", {0, 256}, "descriptors of a guided match differ by at most so many bits"},
      self.max_guided_bits);
    v(ParamDoc{"rival_ratio",
               {0, 1},
               "no answer when another motion explains this part of the inliers with other matches"},
      self.rival_ratio);
    v(ParamDoc{"max_conflict_ratio",
               {0, 1},
               "share of the features that would lie before or behind what the other keyframe sees there"},
      self.max_conflict_ratio);
    v(ParamDoc{"sigma_floor_m", {0, 1}, "added to a registration: what it does not know of itself"},
      self.sigma_floor_m);
    v(ParamDoc{"sigma_floor_rad", {0, 1}, "added to a registration"}, self.sigma_floor_rad);
  }
};

}  // namespace hm
