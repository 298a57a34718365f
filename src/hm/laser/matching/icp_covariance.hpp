#pragma once
#include <vector>

#include "hm/laser/matching/icp_pairs.hpp"

namespace hm {

/// Covariance of the motion that a match found (Censi, ICRA 2007): the noise of every range of both scans,
/// carried through the minimum of the cost, cov = sigma^2 * sum over ranges of (H^-1 d2J/dxdr)(...)^T, in
/// closed form. The curvature of the residuals is left out: it is of the second order in them. Instead, where
/// a residual is larger than the noise that it should have, it counts as it is: surfaces that are not
/// straight and wrong pairs move the minimum too.
class IcpCovariance {
 public:
  /// Where the cost is at its minimum.
  struct At {
    Mat3 inverse = Mat3::Zero();  ///< inverse_information()
    double range_sigma_m = 0;
    bool weigh = true;  ///< by incidence
  };
  /// Of (x, y, angle) of the motion about the sensed scan's origin.
  Mat3 compute(const ReferenceLines& reference, const ScanPoints& sensed, const IcpPairs& pairs,
               const At& at);

 private:
  /// What the error of a range across its line does to (x, y, angle), for any place of the point along it.
  using Influence = Eigen::Array<float, 3, 3>;  // constant, by x, by y; a column each
  std::vector<Influence> influence_;            // differences along the reference's points
};

}  // namespace hm
