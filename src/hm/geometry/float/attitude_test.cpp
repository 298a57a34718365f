#include "hm/geometry/float/attitude.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "hm/core/rng.hpp"

namespace hm {
namespace {

Eigen::Quaterniond precise(const Attitude& q) {
  return {static_cast<double>(q.w), static_cast<double>(q.x), static_cast<double>(q.y),
          static_cast<double>(q.z)};
}

Attitude random_attitude(Rng& rng) {
  const auto part = [&] { return static_cast<float>(rng.normal(0, 1)); };
  return normalised({part(), part(), part(), part()});
}

TEST(Attitude, TurnsVectorsAndComposesAsEigenDoes) {
  Rng rng(1);
  for (int i = 0; i < 1000; ++i) {
    const Attitude a = random_attitude(rng), b = random_attitude(rng);
    const Vec3f v(static_cast<float>(rng.normal(0, 1)), static_cast<float>(rng.normal(0, 1)), 0.7F);
    const Eigen::Vector3d wanted = precise(a) * (precise(b) * v.cast<double>());
    EXPECT_LT(((a * b).rotate(v).cast<double>() - wanted).norm(), 3e-6);
    EXPECT_LT((a.rotate_back(a.rotate(v)) - v).norm(), 3e-6F);
    EXPECT_LT((a.up_axis() - a.rotate(Vec3f(0, 0, 1))).norm(), 1e-6F);
  }
}

TEST(Attitude, EulerAnglesThereAndBack) {
  Rng rng(2);
  for (int i = 0; i < 1000; ++i) {
    const EulerAngles angles{static_cast<float>(rng.uniform(-3, 3)),
                             static_cast<float>(rng.uniform(-1.5, 1.5)),
                             static_cast<float>(rng.uniform(-3.1, 3.1))};
    const Attitude q = attitude_from(angles);
    using Eigen::AngleAxisd;
    using Eigen::Vector3d;
    const Eigen::Quaterniond wanted = AngleAxisd(static_cast<double>(angles.yaw_rad), Vector3d::UnitZ()) *
                                      AngleAxisd(static_cast<double>(angles.pitch_rad), Vector3d::UnitY()) *
                                      AngleAxisd(static_cast<double>(angles.roll_rad), Vector3d::UnitX());
    EXPECT_LT(precise(q).angularDistance(wanted), 1e-6);
    const EulerAngles back = euler_angles(q);
    EXPECT_NEAR(back.roll_rad, angles.roll_rad, 2e-5F);
    EXPECT_NEAR(back.pitch_rad, angles.pitch_rad, 2e-5F);
    EXPECT_NEAR(back.yaw_rad, angles.yaw_rad, 2e-5F);
  }
}

TEST(Attitude, TiltTowardsADirectionPointsThereAndKeepsTheYaw) {
  Rng rng(3);
  for (int i = 0; i < 1000; ++i) {
    const Vec3f up(static_cast<float>(rng.normal(0, 1)), static_cast<float>(rng.normal(0, 1)),
                   static_cast<float>(rng.uniform(0.1, 2)));
    const auto yaw = static_cast<float>(rng.uniform(-3.1, 3.1));
    const EulerAngles angles = tilt_towards(up, yaw);
    const Attitude q = attitude_from(angles);
    EXPECT_LT((q.up_axis() - up / norm_f(up)).norm(), 1e-6F);
    EXPECT_NEAR(euler_angles(q).yaw_rad, yaw, 1e-5F);
    EXPECT_NEAR(q.tilt_rad(), std::atan2(norm_f(up.x(), up.y()), up.z()), 1e-6F);
  }
}

TEST(Attitude, RotationVectorsTurnByTheirLength) {
  Rng rng(4);
  for (const double length : {0.0, 1e-6, 1e-3, 0.3, 3.0}) {
    const Eigen::Vector3d axis =
        Eigen::Vector3d(rng.normal(0, 1), rng.normal(0, 1), rng.normal(0, 1)).normalized();
    const Attitude q = attitude_turned_by((length * axis).cast<float>());
    EXPECT_LT(precise(q).angularDistance(Eigen::Quaterniond(Eigen::AngleAxisd(length, axis))), 1e-6)
        << length;
  }
}

TEST(Attitude, WhatIsNoRotationIsRecognised) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_TRUE(is_unit({0.6F, 0, 0.8F, 0}));
  EXPECT_FALSE(is_unit({0, 0, 0, 0}));
  EXPECT_FALSE(is_unit({nan, 0, 0, 1}));
  EXPECT_FALSE(is_unit({1, 1, 0, 0}));
  EXPECT_EQ(normalised({nan, 0, 0, 1}), Attitude{});
  EXPECT_EQ(normalised({0, 0, 0, 0}), Attitude{});
  EXPECT_EQ(normalised({0, 0, 5, 0}), (Attitude{0, 0, 1, 0}));
}

}  // namespace
}  // namespace hm
