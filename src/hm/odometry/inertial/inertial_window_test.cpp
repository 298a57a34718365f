#include "hm/odometry/inertial/inertial_window.hpp"

#include <gtest/gtest.h>

#include "hm/geometry/solvers/small_solvers.hpp"
#include "hm/geometry/state_bytes.hpp"
#include "hm/odometry/testing/carried_device.hpp"

namespace hm {
namespace {

constexpr double kWindowFrame_s = 0.2;
constexpr double kSigma_m = 0.003, kSigma_rad = 0.002;

const CarriedErrors kErrors{Vec3(0.004, -0.003, 0.002), Vec3(0.08, -0.05, 0.06), 5e-4, 5e-3, 0.008};

/// Poses with noise, along the path.
struct Walk {
  explicit Walk(const CarriedErrors& errors, std::uint64_t seed = 1)
      : rng(seed), readings(carried_readings(-0.3, 25, 200, errors, &rng)) {}

  VisualPose seen(double t_s) {
    Vec6 error = test::drawn<6>([&] { return rng.normal(0, 1); });
    Vec6 sigma;
    sigma << Vec3::Constant(kSigma_m), Vec3::Constant(kSigma_rad);
    error = error.cwiseProduct(sigma);
    return {CarriedPath::pose(t_s) * SE3::exp(error), Mat6(sigma.cwiseAbs2().cwiseInverse().asDiagonal()),
            Vec6::Zero()};
  }
  void add(InertialWindow& window, int frame) {
    window.feed(readings);
    window.add(Time::from_seconds(frame * kWindowFrame_s), seen(frame * kWindowFrame_s));
  }

  Rng rng;
  std::vector<ImuSample> readings;
};

TEST(InertialWindow, FindsBiasesGravityAndDelay) {
  Walk walk(kErrors);
  InertialWindow window;
  for (int i = 0; i < 100; ++i) walk.add(window, i);
  const InertialCommon& found = window.common();
  EXPECT_LT((found.bias.gyro_rad_s - kErrors.gyro_bias_rad_s).norm(), 1e-3);
  EXPECT_LT((found.bias.accel_m_s2 - kErrors.accel_bias_m_s2).norm(), 0.03);
  EXPECT_GT(found.R_odom_level.col(2).z(), std::cos(0.004));
  EXPECT_NEAR(found.delay_s, kErrors.delay_s, 0.001);
}

/// Squared error of the predicted poses by their covariance: chi-squared with six degrees of freedom. Also
/// over a second without images.
TEST(InertialWindow, PredictsAsWellAsItSays) {
  for (const int ahead : {1, 5}) {
    double sum = 0, worst_m = 0;
    int count = 0;
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      Walk walk(kErrors, seed);
      InertialWindow window;
      for (int i = 0; i < 60; ++i) {
        walk.add(window, i);
        if (i < 20 || i % 5 != 0) continue;
        const double t_s = (i + ahead) * kWindowFrame_s;
        const auto predicted = window.predict(Time::from_seconds(t_s));
        ASSERT_TRUE(predicted);
        const Vec6 error = (predicted->state.T_odom_camera.inverse() * CarriedPath::pose(t_s)).log();
        sum += error.dot(solve_symmetric(predicted->pose_covariance(), error));
        worst_m = std::max(worst_m, error.head<3>().norm());
        ++count;
      }
    }
    EXPECT_GT(sum / count, 2.5) << ahead;
    EXPECT_LT(sum / count, 9) << ahead;
    EXPECT_LT(worst_m, ahead == 1 ? 0.02 : 0.10);
  }
}

/// The model is turned and shifted, and all with it: predictions move with it.
TEST(InertialWindow, MovesWithTheModel) {
  const SE3 motion(so3_exp(Vec3(0.1, 0.2, -0.3)), Vec3(1, 2, 3));
  Walk walk(kErrors);
  InertialWindow window;
  for (int i = 0; i < 30; ++i) walk.add(window, i);
  InertialWindow other = window;
  other.move(motion);
  Walk same = walk;
  for (int i = 30; i < 33; ++i) {
    const auto a = window.predict(Time::from_seconds(i * kWindowFrame_s));
    const auto b = other.predict(Time::from_seconds(i * kWindowFrame_s));
    ASSERT_TRUE(a && b);
    EXPECT_LT((motion * a->state.T_odom_camera * b->state.T_odom_camera.inverse()).log().norm(), 1e-6);
    EXPECT_LT((a->pose_covariance() - b->pose_covariance()).norm(), 1e-9);
    walk.add(window, i);
    VisualPose pose = same.seen(i * kWindowFrame_s);
    pose.T_odom_camera = motion * pose.T_odom_camera;
    other.add(Time::from_seconds(i * kWindowFrame_s), pose);
  }
}

TEST(InertialWindow, BeginsAnewAfterAGapOfTheReadings) {
  Walk walk(kErrors);
  walk.readings.erase(walk.readings.begin() + 900, walk.readings.begin() + 940);
  InertialWindow window;
  for (int i = 0; i < 100; ++i) {
    walk.add(window, i);
    EXPECT_GT(window.frame_count(), 0U);
  }
  EXPECT_LT((window.common().bias.accel_m_s2 - kErrors.accel_bias_m_s2).norm(), 0.03);
  EXPECT_FALSE(window.predict(Time::from_seconds(40)));
}

TEST(InertialWindow, IsSavedToTheBit) {
  Walk walk(kErrors);
  InertialWindow window;
  for (int i = 0; i < 30; ++i) walk.add(window, i);
  StateWriter writer;
  writer(window);
  InertialWindow restored;
  StateReader reader(writer.bytes());
  reader(restored);
  ASSERT_TRUE(reader.ok());
  Walk same = walk;
  for (int i = 30; i < 35; ++i) walk.add(window, i), same.add(restored, i);
  const auto a = window.predict(Time::from_seconds(7.2)), b = restored.predict(Time::from_seconds(7.2));
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->state.T_odom_camera.matrix(), b->state.T_odom_camera.matrix());
  EXPECT_EQ(a->covariance, b->covariance);
}

}  // namespace
}  // namespace hm
