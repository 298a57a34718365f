// The dissertation's controllers (2.3.2) in place of the default ones, in the whole autopilot.
#include <gtest/gtest.h>

#include "hm/flight/testing/flight_rig.hpp"

namespace hm {
namespace {

AutopilotParams published() {
  AutopilotParams params;
  params.law = ControlLaw::kPublished;
  return params;
}

TEST(AutopilotLaw, ThePublishedOneTakesOffHoversFliesAndLands) {
  FlightRig rig(published());
  rig.take_off();
  ASSERT_EQ(rig.autopilot->outputs().phase, FlightPhase::kPosition);
  rig.send(CommandKind::kRelease);
  rig.run_ms(8000);
  EXPECT_LT((rig.body.position - Eigen::Vector3d(0, 0, FlightRig::kFeet_m + 1.3)).norm(), 0.1);
  EXPECT_EQ(rig.go_to(0.5F, -0.5F, 1.5F, 0.5F), Refusal::kNone);
  rig.send(CommandKind::kRelease);
  rig.run_ms(15000);
  EXPECT_LT((rig.body.position - Eigen::Vector3d(0.5, -0.5, 1.5)).norm(), 0.1);
  EXPECT_NEAR(rig.body.yaw(), 0.5, 0.05);
  EXPECT_EQ(rig.send(CommandKind::kLand), Refusal::kNone);
  EXPECT_GT(rig.ms_until([&] { return rig.autopilot->outputs().state == AutopilotState::kIdle; }, 12000), 0);
  EXPECT_TRUE(rig.stands());
  EXPECT_LT(rig.hardest_touch_m_s, 0.8);
  EXPECT_LT(rig.largest_tilt_rad, 0.25) << "0.15 rad each of roll and pitch";
}

TEST(AutopilotLaw, ThePublishedOneFliesAGoalAsItIsAndTheDefaultOneShapesIt) {
  const auto pitch_at_once = [](const AutopilotParams& params) {
    FlightRig rig(params);
    rig.take_off();
    rig.go_to(0.3F, 0, 1.5F);
    rig.run_ms(30);
    return rig.autopilot->outputs().rpyt.pitch_rad;
  };
  EXPECT_GT(pitch_at_once(published()), 0.08F) << "0.4 rad/m";
  EXPECT_LT(pitch_at_once({}), 0.08F);
}

TEST(AutopilotLaw, ThePublishedOneFliesVelocitiesOfTheLevelFrame) {
  FlightRig rig(published());
  rig.take_off();
  rig.go_to(0, 0, 1.5F, 1.5708F);
  rig.send(CommandKind::kRelease);
  rig.run_ms(6000);
  ASSERT_NEAR(rig.body.yaw(), 1.57, 0.05);
  ASSERT_EQ(rig.send_mode(FlightPhase::kVelocity), Refusal::kNone);
  for (int i = 0; i < 20; ++i) {
    ASSERT_EQ(rig.fly_velocity(0.6F, 0), Refusal::kNone);
    rig.run_ms(99);
  }
  EXPECT_NEAR(rig.body.velocity.y(), 0.5, 0.2) << "forward is y; its integral may not carry the whole drag";
  EXPECT_NEAR(rig.body.velocity.x(), 0, 0.1);
}

TEST(AutopilotLaw, FailSafesWorkWithThePublishedOneToo) {
  FlightRig rig(published());
  rig.take_off();
  rig.pose = false;
  EXPECT_GT(rig.ms_until([&] { return rig.autopilot->outputs().state == AutopilotState::kLanding; }, 2000),
            0);
  EXPECT_GT(rig.ms_until([&] { return rig.autopilot->outputs().state == AutopilotState::kIdle; }, 12000), 0);
  EXPECT_TRUE(rig.stands());
  EXPECT_LT(rig.largest_tilt_rad, 0.25);
}

}  // namespace
}  // namespace hm
