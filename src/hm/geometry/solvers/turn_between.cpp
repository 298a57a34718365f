#include <Eigen/Geometry>
#include <cmath>

#include "hm/geometry/solvers/small_solvers.hpp"

namespace hm {

Eigen::Quaterniond turn_between(const Vec3& from, const Vec3& to) {
  const Vec3 a = from.normalized(), b = to.normalized();
  const double cosine = b.dot(a);
  Eigen::Quaterniond turn;
  if (cosine < -1 + 1e-12) {
    turn.vec() = a.unitOrthogonal();
    turn.w() = 0;
    return turn;
  }
  const double twice_w = std::sqrt((1 + cosine) * 2);
  turn.vec() = a.cross(b) * (1 / twice_w);
  turn.w() = twice_w * 0.5;
  return turn;
}

}  // namespace hm
