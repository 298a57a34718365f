#include "hm/control/attitude_controller.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "hm/core/rng.hpp"

namespace hm {
namespace {

AttitudeController controller_with(const AttitudeParams& params) {
  return {params, QuadrotorModel{}, 0.001F};
}

TEST(AttitudeController, TheErrorTakenInTwoTurnsIsTheWholeError) {
  Rng rng(1);
  const auto part = [&] { return static_cast<float>(rng.normal(0, 1)); };
  for (int i = 0; i < 2000; ++i) {
    const Attitude measured = normalised({part(), part(), part(), part()});
    const Attitude wanted = normalised({part(), part(), part(), part()});
    const TiltYawError error = tilt_yaw_error(wanted, measured);
    ASSERT_EQ(error.tilt_rad.z(), 0);
    const Attitude tilted = measured * attitude_turned_by(error.tilt_rad);
    EXPECT_LT((tilted.up_axis() - wanted.up_axis()).norm(), 2e-5F);
    const Attitude there = tilted * attitude_turned_by(Vec3f(0, 0, error.yaw_rad));
    EXPECT_LT((there.rotate(Vec3f(1, 2, 3)) - wanted.rotate(Vec3f(1, 2, 3))).norm(), 1e-4F);
    // The tilt is the shortest turn: its length is the angle between the two z axes.
    EXPECT_NEAR(norm_f(error.tilt_rad),
                std::atan2(norm_f(cross_f(measured.up_axis(), wanted.up_axis())),
                           dot_f(measured.up_axis(), wanted.up_axis())),
                2e-3F);
  }
}

TEST(AttitudeController, TheSignOfAQuaternionDoesNotMatter) {
  const AttitudeController controller = controller_with({});
  const Attitude wanted = attitude_from({0.1F, -0.2F, 0.5F});
  const Attitude other{-wanted.w, -wanted.x, -wanted.y, -wanted.z};
  EXPECT_LT((controller.wanted_rates(wanted, {}, 0) - controller.wanted_rates(other, {}, 0)).norm(), 1e-6F);
}

TEST(AttitudeController, TiltComesBeforeYaw) {
  const AttitudeController controller = controller_with({});
  const float tilt = 0.1F;
  const Vec3f alone = controller.wanted_rates(attitude_from({tilt, 0, 0}), {}, 0);
  const Vec3f turned =
      controller.wanted_rates(attitude_turned_by(Vec3f(tilt, 0, 0)) * attitude_from({0, 0, 1.5F}), {}, 0);
  EXPECT_NEAR(alone.x(), 1.6F, 1e-4F);
  EXPECT_NEAR(turned.x(), alone.x(), 1e-4F) << "a yaw error neither slows nor turns the tilt";
  EXPECT_NEAR(turned.y(), 0, 1e-5F);
  EXPECT_NEAR(controller.wanted_rates(attitude_from({0, 0, 0.1F}), {}, 0).z(), 0.32F, 1e-4F);
  EXPECT_NEAR(controller.wanted_rates(attitude_from({0, 0, 1.5F}), {}, 0).z(), 2, 1e-5F) << "limited";
}

TEST(AttitudeController, LargeErrorsGrowWithTheRootAndAreLimited) {
  AttitudeParams params;
  params.tilt_rate_rad_s = 6;
  const AttitudeController controller = controller_with(params);
  const float linear = 80.0F / (16 * 16);
  float before = 0;
  for (float angle = 0.01F; angle < 1.5F; angle += 0.01F) {
    const float rate = controller.wanted_rates(attitude_from({angle, 0, 0}), {}, 0).x();
    const float law = angle < linear ? 16 * angle : std::sqrt(2 * 80 * (angle - linear / 2));
    EXPECT_NEAR(rate, std::min(law, 6.0F), 1e-3F) << angle;
    EXPECT_GE(rate, before - 1e-5F);
    before = rate;
  }
}

TEST(AttitudeController, YawRateIsAboutTheVertical) {
  const Attitude rolled = attitude_from({0.3F, 0, 0});
  const Vec3f rates = controller_with({}).wanted_rates(rolled, rolled, 1);
  EXPECT_LT((rolled.rotate(rates) - Vec3f(0, 0, 1)).norm(), 1e-5F);
}

TEST(AttitudeController, TorqueIsItsEquation) {
  AttitudeParams params;
  params.rate_integral_per_s = 0;
  AttitudeController controller = controller_with(params);
  const Vec3f wanted(1, -2, 0.5F), rates(0.3F, 0.2F, -1);
  const Vec3f torque = controller.step(wanted, rates);
  const Vec3f inertia(0.01F, 0.01F, 0.02F), gains(60, 60, 10);
  const Vec3f law =
      inertia.cwiseProduct(gains.cwiseProduct(wanted - rates)) + cross_f(rates, inertia.cwiseProduct(rates));
  EXPECT_LT((torque - law).norm(), 1e-6F);
}

TEST(AttitudeController, SetPointsCauseNoDerivativeKick) {
  AttitudeController controller = controller_with({});
  controller.step({0, 0, 0}, {0, 0, 0});
  const Vec3f first = controller.step({1, 0, 0}, {0, 0, 0}), second = controller.step({1, 0, 0}, {0, 0, 0});
  EXPECT_NEAR(first.x(), 0.01F * 60, 1e-5F);
  EXPECT_NEAR(second.x(), first.x(), 1e-5F);
  AttitudeController started = controller_with({});
  EXPECT_NEAR(started.step({2, 0, 0}, {2, 0, 0}).x(), 0, 1e-6F) << "nor the first measurement";
}

TEST(AttitudeController, RateIntegralDoesNotWindUp) {
  AttitudeController controller = controller_with({});
  for (int i = 0; i < 5000; ++i) {  // 5 s without any torque
    controller.step({0.5F, 0, 0}, {0, 0, 0});
    controller.applied({0, 0, 0});
  }
  // The integral is unloaded: what is left is the proportional part, not 300 rad/s^2 more.
  const Vec3f torque = controller.step({0.5F, 0, 0}, {0, 0, 0});
  EXPECT_NEAR(torque.x(), 0.01F * 60 * 0.5F, 0.01F * 0.2F);
  for (int i = 0; i < 1000; ++i) {
    const Vec3f now = controller.step({0, 0, 0}, {0, 0, 0});
    controller.applied(now);
  }
  EXPECT_LE(std::abs(controller.step({0, 0, 0}, {0, 0, 0}).x()), 0.01F * 15.01F) << "its own limit";
}

}  // namespace
}  // namespace hm
