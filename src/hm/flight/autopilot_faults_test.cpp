// Sensors that end, hang, jump or have a clock that steps.
#include <gtest/gtest.h>

#include "hm/flight/testing/flight_rig.hpp"

namespace hm {
namespace {

TEST(AutopilotFaults, WithoutAHeightItLandsInTheEnd) {
  FlightRig rig;
  rig.take_off();
  rig.height = rig.clearance = false;
  EXPECT_GT(rig.ms_until([&] { return rig.autopilot->outputs().state == AutopilotState::kIdle; }, 30000), 0);
  EXPECT_TRUE(rig.stands());
  EXPECT_LT(rig.hardest_touch_m_s, 1.0);
}

TEST(AutopilotFaults, ALaserThatEndsMeansADescentByInertia) {
  FlightRig rig;
  rig.take_off();
  rig.pose = rig.height = rig.clearance = false;
  // The floor of the rig gives the IMU no impulse, so that the estimate goes on sinking: the hardest case.
  const int idle =
      rig.ms_until([&] { return rig.autopilot->outputs().state == AutopilotState::kIdle; }, 12000);
  EXPECT_GT(idle, 2500);
  EXPECT_LT(rig.hardest_touch_m_s, 0.8);
  EXPECT_LT(rig.body.position.head<2>().norm(), 0.3);
}

TEST(AutopilotFaults, PosesThatJumpAreRefusedAndItLands) {
  FlightRig rig;
  rig.take_off();
  rig.pose_shift_m = 0.4F;  // less than what the estimator's gate refuses after a second
  const int at =
      rig.ms_until([&] { return rig.autopilot->outputs().phase == FlightPhase::kDeadReckoning; }, 1000);
  EXPECT_GE(at, 170);
  EXPECT_LT(at, 260);
  rig.ms_until([&] { return rig.autopilot->outputs().state == AutopilotState::kLanding; }, 1500);
  EXPECT_EQ(rig.autopilot->outputs().state, AutopilotState::kLanding);
  rig.ms_until([&] { return rig.autopilot->outputs().state == AutopilotState::kIdle; }, 9000);
  EXPECT_TRUE(rig.stands());
  EXPECT_LT(rig.body.position.head<2>().norm(), 0.3);
}

TEST(AutopilotFaults, ASinglePoseThatJumpsIsForgotten) {
  FlightRig rig;
  rig.take_off();
  rig.pose_shift_m = 0.4F;
  rig.run_ms(30);
  rig.pose_shift_m = 0;
  rig.run_ms(3000);
  EXPECT_EQ(rig.autopilot->outputs().phase, FlightPhase::kPosition);
  EXPECT_LT(rig.body.position.head<2>().norm(), 0.05);
}

TEST(AutopilotFaults, AnImuThatHangsIsAGap) {
  FlightRig rig;
  rig.take_off();
  const InertialReading<float> last = *rig.inputs.imu;
  rig.imu = false;
  for (int i = 1; i <= 110; ++i) {
    AutopilotInputs inputs = rig.inputs;
    inputs.now = rig.now + Duration{1'000'000 * i};
    inputs.pose.reset();
    inputs.height.reset();
    inputs.command.reset();
    inputs.imu = last;
    inputs.imu->stamp = inputs.now;
    const SafetyAction action = rig.autopilot->step(inputs).safety.action;
    if (i > 21 && i < 95) {
      EXPECT_EQ(action, SafetyAction::kHoldMotors) << i;
    }
  }
  EXPECT_EQ(rig.autopilot->outputs().state, AutopilotState::kError);
}

TEST(AutopilotFaults, AClockThatStepsDoesNotReachTheEstimate) {
  FlightRig rig;
  rig.take_off();
  const std::uint32_t before = rig.autopilot->outputs().invalid_inputs;
  for (int i = 1; i <= 1000; ++i) {
    rig.imu_ahead_s = i < 500 ? 0.5 : 0;
    rig.run_ms(1);
  }
  EXPECT_EQ(rig.autopilot->outputs().invalid_inputs - before, 499u);
  EXPECT_EQ(rig.autopilot->outputs().phase, FlightPhase::kPosition);
  EXPECT_LT(rig.body.position.head<2>().norm(), 0.05);
}

}  // namespace
}  // namespace hm
