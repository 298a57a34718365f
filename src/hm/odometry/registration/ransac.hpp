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
  std::string reason;  ///< in words, with numbers, when nothing was found
  SE3 T_a_b;
  std::vector<int> inliers;        ///< indices of the pairs that agree with T_a_b, ascending, each once
  Mat6 covariance = Mat6::Zero();  ///< of T_a_b (see RefinedMotion); zero if pairs have none
  int iterations = 0;
};

/// The motion that most pairs agree with (Fischler and Bolles 1981): samples of three different pairs,
/// adaptive stop, refitted to its inliers until they stay (in closed form, or for `kMahalanobis` by
/// covariances). Finds its way through 60 % outliers. `rng` alone decides what is drawn; it is advanced.
RansacMotion ransac_registration(std::span<const PointPair> pairs, const RansacParams& params, Rng& rng);

}  // namespace hm
