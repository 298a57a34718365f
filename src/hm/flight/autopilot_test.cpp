#include "hm/flight/autopilot.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <vector>

#include "hm/flight/testing/flight_rig.hpp"
#include "hm/flight/trace/core_recorder.hpp"

namespace hm {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

bool is_finite(const AutopilotOutputs& out) {
  for (const float speed : out.rotor_speed_rad_s)
    if (!std::isfinite(speed) || speed < 0 || speed > 838.01F) return false;
  return std::isfinite(out.rpyt.roll_rad) && std::isfinite(out.rpyt.pitch_rad) &&
         std::isfinite(out.rpyt.yaw_rate_rad_s) && std::isfinite(out.rpyt.thrust_ratio);
}

TEST(Autopilot, TakesOffHoversFliesAndLands) {
  FlightRig rig;
  EXPECT_EQ(rig.send(CommandKind::kTakeOff), Refusal::kMotorsOff);
  rig.take_off();
  ASSERT_EQ(rig.autopilot->outputs().phase, FlightPhase::kPosition);
  EXPECT_NEAR(rig.body.position.z(), FlightRig::kFeet_m + 1.3, 0.05);
  EXPECT_EQ(rig.go_to(2, 1, 1.0F, 1.5F), Refusal::kNone);
  rig.send(CommandKind::kRelease);
  rig.run_ms(6000);
  EXPECT_LT((rig.body.position - Eigen::Vector3d(2, 1, 1)).norm(), 0.06);
  EXPECT_NEAR(rig.body.yaw(), 1.5, 0.05);
  EXPECT_EQ(rig.send(CommandKind::kLand), Refusal::kNone);
  EXPECT_GT(rig.ms_until([&] { return rig.autopilot->outputs().state == AutopilotState::kIdle; }, 12000), 0);
  EXPECT_TRUE(rig.stands());
  EXPECT_LT((rig.body.position.head<2>() - Eigen::Vector2d(2, 1)).norm(), 0.15);
  EXPECT_LT(rig.hardest_touch_m_s, 0.6);
  EXPECT_LT(rig.largest_tilt_rad, 0.36);
  EXPECT_EQ(rig.send(CommandKind::kToggleEngage), Refusal::kNone);
  rig.run_ms(500);
  EXPECT_EQ(rig.autopilot->outputs().state, AutopilotState::kOff);
  EXPECT_EQ(rig.autopilot->outputs().invalid_inputs, 0u);
}

TEST(Autopilot, LandsWithoutASensorOfTheGround) {
  FlightRig rig;
  rig.clearance = false;
  rig.take_off();
  rig.send(CommandKind::kLand);
  EXPECT_GT(rig.ms_until([&] { return rig.autopilot->outputs().phase == FlightPhase::kTouchDown; }, 12000),
            0);
  EXPECT_TRUE(rig.stands());  // not in the air
  const float before = rig.autopilot->outputs().rpyt.thrust_ratio;
  rig.run_ms(250);
  EXPECT_NEAR(rig.autopilot->outputs().rpyt.thrust_ratio, 0.5F * before, 0.1F * before);
  rig.run_ms(600);
  EXPECT_EQ(rig.autopilot->outputs().state, AutopilotState::kIdle);
}

TEST(Autopilot, StepsAreRelativeToTheHeading) {
  FlightRig rig;
  rig.take_off();
  rig.go_to(0, 0, 1.5F, 1.5708F);
  rig.send(CommandKind::kRelease);
  rig.run_ms(4000);
  FlightCommand step;
  step.kind = CommandKind::kPositionStep;
  step.position_m = {0.25F, 0, 0.25F};
  EXPECT_EQ(rig.send(step), Refusal::kNone);
  rig.send(CommandKind::kRelease);
  rig.run_ms(4000);
  EXPECT_LT((rig.body.position - Eigen::Vector3d(0, 0.25, 1.75)).norm(), 0.05);  // forward is y
}

TEST(Autopilot, EveryRefusalSaysWhy) {
  FlightRig rig;
  EXPECT_EQ(rig.send(CommandKind::kReset), Refusal::kNoError);
  EXPECT_EQ(rig.go_to(1, 1, 1), Refusal::kNotFlying);
  EXPECT_EQ(rig.send(CommandKind::kLand), Refusal::kNotFlying);
  rig.pose = false;
  rig.send(CommandKind::kToggleEngage);
  rig.run_ms(1000);
  EXPECT_EQ(rig.send(CommandKind::kTakeOff), Refusal::kNotReady);
  rig.pose = true;
  rig.battery_ratio = 0.05F;
  rig.run_ms(200);
  EXPECT_EQ(rig.send(CommandKind::kTakeOff), Refusal::kBatteryLow);
  rig.battery_ratio = 0.9F;
  rig.run_ms(1);
  rig.rc = false;
  EXPECT_EQ(rig.send(CommandKind::kTakeOff), Refusal::kRcDisabled);
  rig.rc = true;
  EXPECT_EQ(rig.send(CommandKind::kTakeOff), Refusal::kNone);
  rig.run_ms(1900);
  EXPECT_EQ(rig.go_to(1, 1, 1), Refusal::kWrongMode);  // still climbs
  rig.send(CommandKind::kSignOfLife);
  rig.run_ms(1900);
  EXPECT_EQ(rig.fly_velocity(0.5F, 0), Refusal::kWrongMode);
  EXPECT_EQ(rig.go_to(60, 0, 1), Refusal::kOutOfRange);  // outside of the fence
  EXPECT_EQ(rig.send_mode(FlightPhase::kDeadReckoning), Refusal::kWrongMode);
  EXPECT_EQ(rig.send_mode(FlightPhase::kVelocity), Refusal::kNone);
  EXPECT_EQ(rig.go_to(1, 1, 1), Refusal::kWrongMode);
  FlightCommand other;
  other.pilot = 2;
  other.kind = CommandKind::kHold;
  EXPECT_EQ(rig.send(other), Refusal::kOtherPilot);
  EXPECT_EQ(rig.send(CommandKind::kToggleEngage), Refusal::kAlreadyFlying);
  EXPECT_EQ(rig.send(CommandKind::kEStop), Refusal::kNone);
  EXPECT_EQ(rig.autopilot->outputs().state, AutopilotState::kError);  // in the same step
  EXPECT_EQ(rig.autopilot->outputs().rotor_speed_rad_s, (std::array<float, 4>{}));
  EXPECT_EQ(rig.go_to(1, 1, 1), Refusal::kErrorLatched);
  rig.run_ms(100);
  EXPECT_EQ(rig.send(CommandKind::kReset), Refusal::kNone);
  EXPECT_EQ(rig.autopilot->gate().refused(Refusal::kErrorLatched), 1u);
}

TEST(Autopilot, TakesOffOnlyOnceTheGyroscopesAreCalibrated) {
  FlightRig rig;
  rig.run_ms(100);
  EXPECT_EQ(rig.send(CommandKind::kToggleEngage), Refusal::kNone);
  rig.run_ms(600);
  EXPECT_EQ(rig.autopilot->outputs().state, AutopilotState::kIdle);
  EXPECT_EQ(rig.send(CommandKind::kTakeOff), Refusal::kNotReady);
  rig.run_ms(GyroCalibration::kLeastSamples - 702);  // of all steps so far
  EXPECT_EQ(rig.send(CommandKind::kTakeOff), Refusal::kNone);
  EXPECT_EQ(rig.autopilot->outputs().state, AutopilotState::kFlying);
}

TEST(Autopilot, AVelocityLastsAsLongAsThePilotHoldsIt) {
  FlightRig rig;
  rig.take_off();
  ASSERT_EQ(rig.send_mode(FlightPhase::kVelocity), Refusal::kNone);
  for (int i = 0; i < 20; ++i) {
    ASSERT_EQ(rig.fly_velocity(0.8F, 0), Refusal::kNone);
    rig.run_ms(99);
  }
  EXPECT_NEAR(rig.body.velocity.x(), 0.8, 0.1);
  rig.fly_velocity(0.8F, 0);
  const int held = rig.ms_until([&] { return rig.autopilot->outputs().phase == FlightPhase::kHold; }, 1000);
  EXPECT_NEAR(held, 300, 1);
  rig.run_ms(2500);
  EXPECT_LT(rig.body.velocity.norm(), 0.05);
  EXPECT_EQ(rig.fly_velocity(0.8F, 0), Refusal::kWrongMode);  // not on by itself
  rig.send_mode(FlightPhase::kVelocity);
  FlightCommand released;
  released.kind = CommandKind::kVelocity;
  released.dead_man = false;
  released.velocity_m_s = {1, 0, 0};
  EXPECT_EQ(rig.send(released), Refusal::kNone);
  EXPECT_EQ(rig.autopilot->outputs().phase, FlightPhase::kHold);
}

TEST(Autopilot, DirectCommandsEndInHoldWithoutAJump) {
  FlightRig rig;
  rig.take_off();
  ASSERT_EQ(rig.send_mode(FlightPhase::kDirect), Refusal::kNone);
  for (int i = 0; i < 10; ++i) {
    FlightCommand direct;
    direct.kind = CommandKind::kDirect;
    direct.pitch_rad = 0.1F;
    direct.thrust_ratio = 0.49F;
    ASSERT_EQ(rig.send(direct), Refusal::kNone);
    rig.run_ms(49);
  }
  EXPECT_NEAR(rig.body.pitch(), 0.1, 0.03);
  const int held = rig.ms_until([&] { return rig.autopilot->outputs().phase == FlightPhase::kHold; }, 1000);
  EXPECT_NEAR(held, 100 - 49, 1);
  rig.send(CommandKind::kRelease);
  rig.run_ms(3000);
  EXPECT_LT(rig.body.velocity.norm(), 0.05);
}

TEST(Autopilot, WithoutAPoseItKeepsStillThenDescendsLevel) {
  FlightRig rig;
  rig.take_off();
  rig.pose = false;
  const auto since_pose_ms = [&] { return static_cast<double>((rig.now - rig.last_pose).ns) * 1e-6; };
  rig.ms_until([&] { return rig.autopilot->outputs().phase == FlightPhase::kDeadReckoning; }, 1000);
  EXPECT_NEAR(since_pose_ms(), 200, 1);
  rig.ms_until([&] { return rig.autopilot->outputs().state == AutopilotState::kLanding; }, 2000);
  EXPECT_NEAR(since_pose_ms(), 1000, 1);
  EXPECT_EQ(rig.send(CommandKind::kHold), Refusal::kLandingForced);
  rig.send(CommandKind::kRelease);
  EXPECT_GT(rig.ms_until([&] { return rig.autopilot->outputs().state == AutopilotState::kIdle; }, 12000), 0);
  EXPECT_LT(rig.largest_tilt_rad, 0.36);
  EXPECT_LT(rig.hardest_touch_m_s, 0.7);
}

TEST(Autopilot, RecoveryLeadsToHoldNotToWhatWasBefore) {
  FlightRig rig;
  rig.take_off();
  rig.go_to(10, 0, 1.5F);
  rig.send(CommandKind::kRelease);
  rig.run_ms(1500);
  rig.pose = false;
  rig.run_ms(400);
  ASSERT_EQ(rig.autopilot->outputs().phase, FlightPhase::kDeadReckoning);
  EXPECT_EQ(rig.go_to(1, 1, 1), Refusal::kFailSafeActive);
  rig.send(CommandKind::kRelease);
  rig.pose = true;
  rig.run_ms(50);
  EXPECT_EQ(rig.autopilot->outputs().phase, FlightPhase::kHold);
  rig.run_ms(5000);
  EXPECT_EQ(rig.autopilot->outputs().phase, FlightPhase::kHold);
  EXPECT_LT(rig.body.position.x(), 5);  // not on to 10 m
  EXPECT_LT(rig.body.velocity.norm(), 0.05);
}

TEST(Autopilot, WithoutAHeightItSinksSlowly) {
  FlightRig rig;
  rig.take_off();
  rig.height = false;
  rig.ms_until([&] { return rig.autopilot->outputs().safety.action == SafetyAction::kSinkSlowly; }, 2000);
  EXPECT_NEAR(static_cast<double>((rig.now - rig.last_height).ns) * 1e-6, 500, 1);
  double fastest = 0;
  rig.ms_until(
      [&] {
        fastest = std::max(fastest, -rig.body.velocity.z());
        return rig.stands();
      },
      20000);
  EXPECT_TRUE(rig.stands());
  EXPECT_LT(fastest, 1.0);
}

TEST(Autopilot, RefusedPosesCountAsNone) {
  FlightRig rig;
  rig.take_off();
  rig.pose_shift_m = 3;
  const int at = rig.ms_until(
      [&] {
        return rig.autopilot->outputs().safety.has(FailSafe::kPoseRefused) ||
               rig.autopilot->outputs().safety.has(FailSafe::kPoseStale);
      },
      1500);
  EXPECT_GT(at, 100);
  EXPECT_LT(at, 600);
  EXPECT_EQ(rig.autopilot->outputs().phase, FlightPhase::kDeadReckoning);
}

TEST(Autopilot, ASilentPilotMeansHoldThenTheWayHome) {
  FlightRig rig;
  rig.take_off();
  rig.go_to(3, 0, 1.5F);
  rig.run_ms(1900);
  rig.go_to(3, 2, 1.5F);
  int at = rig.ms_until([&] { return rig.autopilot->outputs().safety.has(FailSafe::kPilotLost); }, 3000);
  EXPECT_NEAR(at, 2000, 1);
  EXPECT_EQ(rig.autopilot->outputs().phase, FlightPhase::kHold);
  at += rig.ms_until([&] { return rig.autopilot->outputs().phase == FlightPhase::kReturn; }, 10000);
  EXPECT_NEAR(at, 10000, 2);
  EXPECT_GT(rig.ms_until([&] { return rig.autopilot->outputs().state == AutopilotState::kIdle; }, 30000), 0);
  EXPECT_LT(rig.body.position.head<2>().norm(), 0.35);  // at home
}

TEST(Autopilot, AnEmptyBatterySendsItHomeOrDown) {
  FlightRig rig;
  rig.battery_ratio = 0.9F;
  rig.take_off();
  rig.go_to(3, 0, 1.5F);
  rig.send(CommandKind::kRelease);
  rig.run_ms(4000);
  rig.battery_ratio = 0.101F;  // the way home takes 0.3 %
  EXPECT_NEAR(rig.ms_until([&] { return rig.autopilot->outputs().phase == FlightPhase::kReturn; }, 2000),
              1001, 1);
  rig.battery_ratio = 0.09F;
  EXPECT_NEAR(rig.ms_until([&] { return rig.autopilot->outputs().state == AutopilotState::kLanding; }, 2000),
              1001, 1);
  rig.battery_ratio = 0.9F;  // the voltage recovers: the landing goes on
  rig.run_ms(500);
  EXPECT_EQ(rig.autopilot->outputs().state, AutopilotState::kLanding);
}

TEST(Autopilot, ASilentComputerMeansALevelDescent) {
  FlightRig rig;
  rig.take_off();
  rig.alive = false;
  EXPECT_NEAR(rig.ms_until([&] { return rig.autopilot->outputs().state == AutopilotState::kLanding; }, 2000),
              1000, 1);
  rig.alive = true;
  rig.run_ms(2);
  EXPECT_EQ(rig.autopilot->outputs().phase, FlightPhase::kHold);
}

TEST(Autopilot, TheFenceClampsAndTurnsBack) {
  AutopilotParams params;
  params.guidance.fence_radius_m = 2;
  FlightRig rig(params);
  rig.take_off();
  rig.send_mode(FlightPhase::kVelocity);
  double furthest = 0;
  for (int i = 0; i < 60; ++i) {
    rig.fly_velocity(1.0F, 0);
    rig.run_ms(99);
    furthest = std::max(furthest, rig.body.position.x());
  }
  EXPECT_GT(furthest, 1.5);
  EXPECT_LT(furthest, 2.15);
}

TEST(Autopilot, AnObstacleAheadStopsIt) {
  FlightRig rig;
  rig.take_off();
  rig.go_to(8, 0, 1.5F);
  rig.send(CommandKind::kRelease);
  double nearest = 10;
  for (int i = 0; i < 8000; ++i) {
    rig.obstacle_m = static_cast<float>(4 - rig.body.position.x());
    rig.run_ms(1);
    nearest = std::min(nearest, 4 - rig.body.position.x());
  }
  EXPECT_GT(nearest, 0.35);  // of obstacle_margin_m
  EXPECT_LT(nearest, 0.6);
  EXPECT_EQ(rig.autopilot->outputs().phase, FlightPhase::kHold);
}

TEST(Autopilot, AGapOfTheImuHoldsTheMotorsALossCutsThem) {
  FlightRig rig;
  rig.take_off();
  rig.imu = false;
  EXPECT_NEAR(
      rig.ms_until([&] { return rig.autopilot->outputs().safety.action == SafetyAction::kHoldMotors; }, 100),
      20, 1);
  const auto speeds = rig.autopilot->outputs().rotor_speed_rad_s;
  rig.run_ms(40);
  EXPECT_EQ(rig.autopilot->outputs().rotor_speed_rad_s, speeds);
  rig.imu = true;
  rig.run_ms(2);
  EXPECT_EQ(rig.autopilot->outputs().phase, FlightPhase::kHold);
  rig.run_ms(3000);
  EXPECT_LT(rig.body.velocity.norm(), 0.1);
  rig.imu = false;
  EXPECT_NEAR(rig.ms_until([&] { return rig.autopilot->outputs().state == AutopilotState::kError; }, 200),
              100, 1);
  EXPECT_EQ(rig.autopilot->outputs().rotor_speed_rad_s, (std::array<float, 4>{}));
}

TEST(Autopilot, AnOverturnedVehicleIsCut) {
  FlightRig rig;
  rig.take_off();
  int at = -1;
  for (int i = 0; i < 400 && at < 0; ++i) {
    rig.body.rotation =
        Eigen::AngleAxisd(1.2, Eigen::Vector3d::UnitX()).toRotationMatrix();  // hangs in a tree
    rig.body.rates.setZero();
    rig.run_ms(1);
    if (rig.autopilot->outputs().state == AutopilotState::kError) at = i;
  }
  EXPECT_NEAR(at, 100, 1);
}

TEST(Autopilot, ATurnedPositionSensorMakesItLandAndSaysTheAngle) {
  FlightRig rig;
  rig.take_off();
  rig.pose_turned_rad = 1.5708F;
  rig.go_to(1.5F, 0.5F, 1.5F);
  rig.send(CommandKind::kRelease);
  EXPECT_GT(rig.ms_until([&] { return rig.autopilot->outputs().safety.has(FailSafe::kTiltMismatch); }, 60000),
            0);
  EXPECT_EQ(rig.autopilot->outputs().state, AutopilotState::kLanding);
  ASSERT_TRUE(rig.autopilot->outputs().tilt_mismatch_rad);
  EXPECT_NEAR(*rig.autopilot->outputs().tilt_mismatch_rad, 1.57F, 0.6F);
  EXPECT_LT(rig.body.position.head<2>().norm(), 12);  // not carried off
}

TEST(Autopilot, BadInputReachesNoOutput) {
  FlightRig rig;
  const auto polluted = std::make_unique<Autopilot>();
  std::uint32_t broken = 0;
  for (int i = 0; i < 9000; ++i) {
    rig.take_off_step(i);
    AutopilotInputs inputs = rig.inputs;
    if (!inputs.pose) inputs.pose = PoseReading<float>{rig.now, {0, kNan, 0}, {}}, ++broken;
    if (!inputs.height) inputs.height = BasicHeightReading<float>{rig.now, kNan, {}}, ++broken;
    if (!inputs.command) inputs.command = FlightCommand{Time{}, 1, CommandKind::kLand};  // long ago
    polluted->step(inputs);
    polluted->step(inputs);  // the same step twice
    ++broken;
    ASSERT_EQ(rig.autopilot->outputs().rotor_speed_rad_s, polluted->outputs().rotor_speed_rad_s) << i;
  }
  EXPECT_EQ(polluted->outputs().invalid_inputs, broken);
  EXPECT_EQ(polluted->outputs().state, AutopilotState::kFlying);
  EXPECT_EQ(polluted->gate().refused(Refusal::kStaleStamp), 8997u);
}

TEST(Autopilot, ASecondTakeOffStartsFromZero) {
  FlightRig rig;
  rig.take_off();
  rig.go_to(1.5F, -1, 1.2F);
  rig.send(CommandKind::kRelease);
  rig.run_ms(4000);
  const auto state = [&] { return rig.autopilot->outputs().state; };
  rig.send(CommandKind::kLand);
  ASSERT_GT(rig.ms_until([&] { return state() == AutopilotState::kIdle; }, 12000), 0);
  const Eigen::Vector2d place = rig.body.position.head<2>();
  EXPECT_GT(place.norm(), 1.5);  // away from the origin
  EXPECT_EQ(rig.send(CommandKind::kTakeOff), Refusal::kNone);
  EXPECT_EQ(rig.autopilot->cascade().integral_m_s2(), Vec3f::Zero());
  rig.send(CommandKind::kRelease);
  double most_m = 0;
  for (int i = 0; i < 5000; ++i) {
    rig.run_ms(1);
    most_m = std::max(most_m, (rig.body.position.head<2>() - place).norm());
  }
  EXPECT_LT(most_m, 0.1);
  EXPECT_NEAR(rig.body.position.z(), FlightRig::kFeet_m + 1.3, 0.05);
}

TEST(Autopilot, RubbishInPlaceOfEveryInputLeavesOutputsFinite) {
  FlightRig rig;
  rig.take_off();
  Rng rng(6);
  const auto rubbish = [&] {
    const std::array<float, 5> values{kNan, std::numeric_limits<float>::infinity(), -1e30F, 1e30F, 0};
    return values[rng.below(5)];
  };
  for (int i = 0; i < 3000; ++i) {
    AutopilotInputs bad = rig.inputs;
    bad.now = rig.now = rig.now + Duration{1'000'000};
    const Time any{rig.now.ns + static_cast<std::int64_t>(rng.uniform(-1e9, 1e9))};
    bad.imu = InertialReading<float>{any, Vec3f::Constant(rubbish()), Vec3f::Constant(rubbish()), {}};
    bad.pose = PoseReading<float>{any, Vec3f::Constant(rubbish()), {}};
    bad.height = BasicHeightReading<float>{any, rubbish(), rubbish()};
    bad.battery_ratio = bad.clearance_m = bad.obstacle_m = rubbish();
    FlightCommand command;
    command.stamp = any;
    command.pilot = 1;
    command.kind = static_cast<CommandKind>(rng.below(static_cast<std::uint32_t>(kCommandKindCount)));
    if (command.kind == CommandKind::kEStop) command.kind = CommandKind::kDirect;
    command.position_m = command.velocity_m_s = Vec3f::Constant(rubbish());
    command.thrust_ratio = command.yaw_rad = rubbish();
    bad.command = command;
    rig.autopilot->step(bad);
    ASSERT_TRUE(is_finite(rig.autopilot->outputs())) << i;
  }
  EXPECT_GT(rig.autopilot->outputs().invalid_inputs, 1000u);
}

TEST(Autopilot, SameInputsSameBits) {
  FlightRig rig;
  const auto twin = std::make_unique<Autopilot>();
  for (int i = 0; i < 6000; ++i) {
    if (i == 1500)
      rig.send(CommandKind::kToggleEngage);
    else if (i == 2500)
      rig.send(CommandKind::kTakeOff);
    else
      rig.run_ms(1);
    twin->step(rig.inputs);
    const AutopilotOutputs& outputs = rig.autopilot->outputs();
    ASSERT_EQ(encode(core_outputs_record(outputs, rig.autopilot->estimate(), 0)),
              encode(core_outputs_record(twin->outputs(), twin->estimate(), 0)))
        << i;
  }
  EXPECT_EQ(twin->outputs().state, AutopilotState::kFlying);
}

TEST(Autopilot, FitsTheMemoryOfAMicrocontroller) {
  EXPECT_LE(sizeof(Autopilot), 15u * 1024u);  // a kilobyte is for the stack
  RecordProperty("autopilot_bytes", static_cast<int>(sizeof(Autopilot)));
  RecordProperty("estimator_bytes", static_cast<int>(sizeof(BoardEstimator)));
}

}  // namespace
}  // namespace hm
