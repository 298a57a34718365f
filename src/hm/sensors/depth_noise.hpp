#pragma once
#include "hm/core/params.hpp"

namespace hm {

/// Axial noise of a depth sensor: standard deviation (metres) of a reading at depth z (metres), sigma(z) =
/// quadratic z^2 + linear z + constant (dissertation 4.1.3).
///
/// The default is the Kinect model of Nguyen et al. 2012, 0.0012 + 0.0019 (z - 0.4)^2, expanded. Its linear
/// term is negative; the wrong sign would give bands up to 2.6 times too wide.
struct DepthNoise {
  double quadratic_per_m = 0.0019;
  double linear_ratio = -0.00152;
  double constant_m = 0.001504;

  /// Standard deviation in metres; never below a tenth of a millimetre.
  [[nodiscard]] double sigma_m(double depth_m) const {
    const double sigma = (quadratic_per_m * depth_m + linear_ratio) * depth_m + constant_m;
    return sigma > 1e-4 ? sigma : 1e-4;
  }

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"quadratic_per_m", {0, 1}, "axial depth noise: factor of z^2", ParamLevel::kBasic},
      self.quadratic_per_m);
    v(ParamDoc{"linear_ratio", {-1, 1}, "axial depth noise: factor of z", ParamLevel::kBasic},
      self.linear_ratio);
    v(ParamDoc{"constant_m", {0, 1}, "axial depth noise: constant part", ParamLevel::kBasic},
      self.constant_m);
  }
};

}  // namespace hm
