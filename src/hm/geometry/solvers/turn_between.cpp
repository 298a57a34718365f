// hm: compiled alone, as it takes as long as a unit of many files
#include <Eigen/Geometry>
#include <Eigen/SVD>

#include "hm/geometry/solvers/small_solvers.hpp"

namespace hm {

Eigen::Quaterniond turn_between(const Vec3& from, const Vec3& to) {
  return Eigen::Quaterniond::FromTwoVectors(from, to);
}

}  // namespace hm
