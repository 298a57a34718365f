#include "hm/geometry/planar_covariance.hpp"

namespace hm {

Mat3 compose_covariance(const SE2& T_a_b, const Mat3& covariance_a_b, const SE2& T_b_c,
                        const Mat3& covariance_b_c) {
  Mat3 first = Mat3::Identity();
  const Vec2 lever = T_a_b.rotation() * T_b_c.translation();
  first(0, 2) = -lever.y();
  first(1, 2) = lever.x();
  return first * covariance_a_b * first.transpose() + turned_covariance(T_a_b.rotation(), covariance_b_c);
}

Mat3 turned_covariance(const Mat2& R_a_b, const Mat3& covariance_b) {
  Mat3 turn = Mat3::Identity();
  turn.topLeftCorner<2, 2>() = R_a_b;
  return turn * covariance_b * turn.transpose();
}

}  // namespace hm
