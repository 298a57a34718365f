#pragma once
#include <vector>

#include "hm/laser/matching/icp_pairs.hpp"

namespace hm {

/// Covariance of a matched transform (Censi, ICRA 2007): the noise of every range of both scans, propagated
/// through the minimum of the cost, cov = sigma^2 * sum over ranges of (H^-1 d2J/dxdr)(...)^T, in closed
/// form. The second-order curvature of the residuals is neglected. Instead, a residual larger than its
/// expected noise replaces it, since curved surfaces and wrong pairs also shift the minimum.
class IcpCovariance {
 public:
  /// Linearisation at the minimum of the cost.
  struct At {
    Mat3 inverse = Mat3::Zero();  ///< inverse_information()
    double range_sigma_m = 0;
    bool weigh = true;  ///< weight by incidence angle
  };
  /// Covariance of (x, y, angle) of the transform, about the sensed scan's origin.
  Mat3 compute(const ReferenceLines& reference, const ScanPoints& sensed, const IcpPairs& pairs,
               const At& at);

 private:
  /// Effect of a range error across its line on (x, y, angle), for any position of the point along the line.
  using Influence = Eigen::Array<float, 3, 3>;  // constant, by x, by y; a column each
  std::vector<Influence> influence_;            // differences along the reference's points
};

}  // namespace hm
