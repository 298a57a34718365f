// hm: compiled alone, as it takes as long as a unit of many files
#include <Eigen/SVD>

#include "hm/geometry/solvers/small_solvers.hpp"

namespace hm {

Svd3 svd_of(const Mat3& A) {
  const Eigen::JacobiSVD<Mat3> svd(A, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return {svd.matrixU(), svd.matrixV(), svd.singularValues()};
}

}  // namespace hm
