#include "hm/geometry/level/up_direction.hpp"

#include <gtest/gtest.h>

#include "hm/core/rng.hpp"

namespace hm {
namespace {

TEST(UpDirection, TextsAreReadAgain) {
  EXPECT_EQ(to_string(z_is_up()), "z");
  EXPECT_EQ(to_string(UpDirection{}), "unknown");
  EXPECT_EQ(to_string(UpDirection{-Vec3::UnitY(), UpSource::kFloorAndWalls, 0.01}),
            "-y (from floor and walls)");
  const UpDirection tilted{Vec3(0.1, -0.9, -0.3).normalized(), UpSource::kGravityAndLevels, 0.01};
  for (const UpDirection& up :
       {z_is_up(), UpDirection{}, tilted, UpDirection{Vec3::UnitX(), UpSource::kGravity, 0.1}}) {
    const auto read = parse_up(to_string(up));
    ASSERT_TRUE(read) << to_string(up);
    EXPECT_EQ(read->source, up.source);
    if (up.known()) {
      EXPECT_LT((read->up - up.up).norm(), 1e-4);
    }
  }
  for (const char* wrong : {"", "up", "0 0", "0 0 5", "z (from hearsay)", "0 0 nan", "0 0 1 1"})
    EXPECT_FALSE(parse_up(wrong)) << wrong;
}

TEST(UpDirection, AxesAreTurnedToZExactly) {
  for (int k = 0; k < 3; ++k)
    for (const double sign : {1.0, -1.0}) {
      Vec3 up = Vec3::Zero();
      up[k] = sign;
      const Mat3 R = rotation_to_z_up(up);
      EXPECT_EQ(R * up, Vec3::UnitZ());
      EXPECT_EQ(R * R.transpose(), Mat3::Identity());
      EXPECT_EQ(R.determinant(), 1);
    }
  Rng rng(3);
  for (int i = 0; i < 200; ++i) {
    const Vec3 up = Vec3(rng.normal(), rng.normal(), rng.normal()).normalized();
    const Mat3 R = rotation_to_z_up(up);
    EXPECT_LT((R * up - Vec3::UnitZ()).norm(), 1e-12);
    EXPECT_LT((R * R.transpose() - Mat3::Identity()).norm(), 1e-12);
  }
  EXPECT_LT(
      (rotation_to_z_up(Vec3(1e-5, 0, -1).normalized()) * Vec3(1e-5, 0, -1).normalized() - Vec3::UnitZ())
          .norm(),
      1e-9);
}

TEST(UpDirection, ALevelFrameLooksAheadWhateverTheCamerasTilt) {
  Rng rng(4);
  for (int i = 0; i < 200; ++i) {
    const Vec3 up = Vec3(rng.normal(), rng.normal(), rng.normal()).normalized();
    const SE3 T = level_pose(up);
    EXPECT_TRUE(is_rigid(T));
    EXPECT_LT((T.rotation() * up - Vec3::UnitZ()).norm(), 1e-12);
    const Vec3 ahead = T.rotation().col(2);
    if (std::abs(up.z()) < 0.9) {
      EXPECT_NEAR(ahead.y(), 0, 1e-12);
      EXPECT_GT(ahead.x(), 0);
    }
  }
  const SE3 down = level_pose(-Vec3::UnitZ());  // looks straight down: the image's top is ahead
  EXPECT_LT((down.rotation() * -Vec3::UnitY() - Vec3::UnitX()).norm(), 1e-12);
  const SE3 upright = level_pose(-Vec3::UnitY());
  EXPECT_EQ(upright.rotation() * Vec3::UnitZ(), Vec3::UnitX());
  EXPECT_EQ(upright.rotation() * Vec3::UnitX(), -Vec3::UnitY());
}

TEST(UpDirection, AFrameThatIsLevelWithinTheMeasurementKeepsItsAxis) {
  EXPECT_EQ(snapped_to_axis(Vec3(0.005, 0, 1).normalized()), Vec3::UnitZ());
  EXPECT_EQ(snapped_to_axis(Vec3(0.005, -1, 0.003).normalized()), -Vec3::UnitY());
  const Vec3 tilted = Vec3(0.02, 0, 1).normalized();
  EXPECT_EQ(snapped_to_axis(tilted), tilted);
}

}  // namespace
}  // namespace hm
