#pragma once
#include <span>
#include <string>
#include <vector>

#include "hm/core/rng.hpp"
#include "hm/odometry/registration/ransac_params.hpp"
#include "hm/odometry/registration/rigid_registration.hpp"

namespace hm {

struct RansacMotion {
  bool found = false;
  std::string reason;  ///< explanation when nothing was found
  SE3 T_a_b;
  std::vector<int> inliers;        ///< indices of the pairs consistent with T_a_b, ascending
  Mat6 covariance = Mat6::Zero();  ///< of T_a_b (see RefinedMotion); zero if pairs have none
  int iterations = 0;
};

/// Estimates the transform with most inlier pairs by RANSAC (Fischler and Bolles 1981): samples of three
/// distinct pairs, adaptive termination, refitted to its inliers until they are stable (in closed form, or
/// for `kMahalanobis` with covariances). Handles 60 % outliers. Samples depend only on `rng`, which is
/// advanced.
RansacMotion ransac_registration(std::span<const PointPair> pairs, const RansacParams& params, Rng& rng);

}  // namespace hm
