// hm: compiled alone, as it takes as long as a unit of many files
#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "hm/geometry/solvers/small_solvers.hpp"

namespace hm {

Vec3 solve_symmetric_3(const Mat3& A, const Vec3& b) { return A.ldlt().solve(b); }

Vec6 solve_symmetric(const Mat6& A, const Vec6& b) { return A.ldlt().solve(b); }

Mat6 inverse_of(const Mat6& A) { return A.inverse(); }

}  // namespace hm
