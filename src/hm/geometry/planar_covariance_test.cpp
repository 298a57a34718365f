#include "hm/geometry/planar_covariance.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

namespace hm {
namespace {

TEST(PlanarCovariance, FusesWhatOneLeavesFree) {
  const Mat3 turned = Eigen::AngleAxisd(0.3, Vec3(1, 2, 3).normalized()).matrix();
  const Mat3 a = turned * Vec3(1e4, 1e-6, 1e-7).asDiagonal() * turned.transpose();
  const Mat3 b = turned * Vec3(4e-2, 1, 1e-6).asDiagonal() * turned.transpose();
  const Vec3 expected(4e-2, 1e-6, 1e-7 / 1.1);
  const Vec3 fused = (turned.transpose() * fused_covariance(a, b) * turned).diagonal();
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(fused[k], expected[k], 1e-4 * expected[k]) << k;
  EXPECT_TRUE(fused_covariance(Mat3::Zero(), b).isZero());
}

}  // namespace
}  // namespace hm
