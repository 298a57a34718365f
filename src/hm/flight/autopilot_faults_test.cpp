// Sensors that end, hang, jump, repeat themselves or have a clock that steps.
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

TEST(AutopilotFaults, RepeatedAndOlderMeasurementsAreIgnoredAndCounted) {
  FlightRig rig;
  const auto polluted = std::make_unique<Autopilot>();
  std::uint32_t repeated = 0;
  std::optional<PoseReading<float>> pose;
  std::optional<BasicHeightReading<float>> height;
  for (int i = 0; i < 5000; ++i) {
    rig.take_off_step(i);
    AutopilotInputs inputs = rig.inputs;
    if (inputs.pose) pose = inputs.pose;
    if (inputs.height) height = inputs.height;
    const Duration older{i % 2 == 0 ? 0 : 10'000'000};
    if (!inputs.pose && pose) {  // what was measured before, somewhere else
      inputs.pose = PoseReading<float>{pose->stamp - older, {0.3F, 0, 0.1F}, {}};
      ++repeated;
    }
    if (!inputs.height && height) {
      inputs.height = BasicHeightReading<float>{height->stamp - older, 0.5F, {}};
      ++repeated;
    }
    polluted->step(inputs);
    ASSERT_EQ(rig.autopilot->outputs().rotor_speed_rad_s, polluted->outputs().rotor_speed_rad_s) << i;
    ASSERT_EQ(rig.autopilot->estimate().position_m, polluted->estimate().position_m) << i;
  }
  EXPECT_EQ(polluted->outputs().invalid_inputs - rig.autopilot->outputs().invalid_inputs, repeated);
  EXPECT_EQ(polluted->outputs().state, AutopilotState::kFlying);
}

}  // namespace
}  // namespace hm
