#include "hm/estimation/filter_math.hpp"

#include <gtest/gtest.h>

#include "hm/core/rng.hpp"

namespace hm {
namespace {

TEST(FilterMath, WrapsLikeTheDoubleFunction) {
  Rng rng(4);
  for (int i = 0; i < 10000; ++i) {
    const auto angle = static_cast<float>(rng.uniform(-30, 30));
    const double difference = wrap_angle(static_cast<double>(wrap_angle(angle)) - static_cast<double>(angle));
    ASSERT_NEAR(difference, 0, 3e-6);
    ASSERT_LE(std::abs(wrap_angle(angle)), std::numbers::pi_v<float>);
  }
}

TEST(FilterMath, RotationsAndAnglesOfFloatsAreThoseOfDoubles) {
  Rng rng(5);
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector3d angles(rng.uniform(-3, 3), rng.uniform(-1.4, 1.4), rng.uniform(-3, 3));
    const FilterVector<float, 3> narrow = angles.cast<float>();
    const FilterMatrix<float, 3> rotation = rotation_from_angles(narrow);
    ASSERT_LT((rotation.cast<double>() - rotation_from_angles(angles)).norm(), 2e-6);
    ASSERT_LT((angles_of(rotation).cast<double>() - angles).norm(), 2e-5);
    const Eigen::Vector3d vector(rng.normal(0, 0.5), rng.normal(0, 0.5), rng.normal(0, 0.5));
    const Eigen::Quaterniond start(rotation_from_angles(angles));
    const FilterQuaternion<float> end =
        turned(FilterQuaternion<float>(start.cast<float>()), vector.cast<float>());
    ASSERT_LT(end.cast<double>().angularDistance(turned(start, vector)), 3e-6);
    ASSERT_NEAR(end.coeffs().norm(), 1, 1e-6);
    const FilterQuaternion<float> shortest =
        shortest_turn(narrow, FilterVector<float, 3>(vector.cast<float>()));
    ASSERT_LT((shortest * narrow.normalized() - vector.normalized().cast<float>()).norm(), 1e-4);
  }
  const FilterVector<float, 3> x(1, 0, 0);
  EXPECT_LT((shortest_turn(x, FilterVector<float, 3>(-x)) * x + x).norm(), 1e-6);  // half a turn
}

TEST(FilterMath, TimeSpansAsFloats) {
  EXPECT_EQ(seconds_of<double>(Duration{1'234'567}), Duration{1'234'567}.seconds());
  EXPECT_FLOAT_EQ(seconds_of<float>(Duration{4'000'000}), 0.004F);
  EXPECT_FLOAT_EQ(seconds_of<float>(Duration{-1'500'000}), -0.0015F);
  EXPECT_FLOAT_EQ(seconds_of<float>(Duration{3'600'000'000'000}), 3600.0F);
  EXPECT_GT(seconds_of<float>(Duration{std::int64_t{1} << 62}), 2e6F);  // bounded, with its sign
  EXPECT_LT(seconds_of<float>(Duration{-(std::int64_t{1} << 62)}), -2e6F);
  EXPECT_EQ(duration_of(0.18F).ns, 180'000'000);
  EXPECT_EQ(duration_of(-0.18F).ns, -180'000'000);
}

}  // namespace
}  // namespace hm
