#pragma once
#include <Eigen/Core>

namespace hm::test {

/// A vector of numbers that are drawn one by one, the last coordinate first. As arguments of one call they
/// would be drawn in an order of the compiler's choice (g++ takes this one, clang the other), so that a test
/// would see other numbers with each.
template <int N, class Draw>
auto drawn(const Draw& draw) {
  Eigen::Matrix<decltype(draw()), N, 1> vector;
  for (int k = N - 1; k >= 0; --k) vector[k] = draw();
  return vector;
}

}  // namespace hm::test
