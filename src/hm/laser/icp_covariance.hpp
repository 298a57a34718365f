#pragma once
#include <vector>

#include "hm/laser/icp_pairs.hpp"

namespace hm {

/// Covariance of the motion that a match found (Censi, ICRA 2007): the noise of every range of both scans,
/// carried through the minimum of the cost, cov = sigma^2 * sum over ranges of (H^-1 d2J/dxdr)(...)^T, in
/// closed form. The curvature of the residuals is left out: it is of the second order in them.
class IcpCovariance {
 public:
  /// Of (x, y, angle) of the motion about the sensed scan's origin; `inverse` is inverse_information().
  Mat3 compute(const ReferenceLines& reference, const ScanPoints& sensed, const IcpPairs& pairs,
               const Mat3& inverse, bool weigh);

 private:
  struct Influence {
    float x = 0, y = 0, angle = 0;
  };
  std::vector<Influence> influence_;  // differences along the reference's points
};

}  // namespace hm
