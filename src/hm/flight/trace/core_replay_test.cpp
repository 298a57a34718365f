#include "hm/flight/trace/core_replay.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <set>
#include <tuple>
#include <vector>

#include "hm/flight/testing/flight_course.hpp"
#include "hm/flight/trace/core_recorder.hpp"

namespace hm {
namespace {

std::vector<CoreTraceRecord> course() {
  FlightRig rig;
  CoreRecorder recorder;
  std::vector<CoreTraceRecord> trace;
  rig.after_step = [&](const FlightRig& now) {
    for (const CoreTraceRecord& record :
         recorder.step(now.inputs, now.autopilot->outputs(), now.autopilot->estimate()))
      trace.push_back(record);
  };
  fly_course(rig);
  return trace;
}

std::optional<CoreDifference> replay(const std::vector<CoreTraceRecord>& trace,
                                     const AutopilotParams& params = {}) {
  const auto autopilot = std::make_unique<Autopilot>(params);
  CoreReplay replay(*autopilot);
  for (const CoreTraceRecord& record : trace)
    if (const auto difference = replay.add(*decode_core_trace(encode(record)))) return difference;
  return {};
}

TEST(CoreReplay, TheCourseGoesThroughStatesPhasesAndFailSafes) {
  std::set<int> states, phases, refusals;
  std::uint32_t fail_safes = 0;
  FlightRig rig;
  rig.after_step = [&](const FlightRig& now) {
    const AutopilotOutputs& out = now.autopilot->outputs();
    states.insert(static_cast<int>(out.state));
    phases.insert(static_cast<int>(out.phase));
    refusals.insert(static_cast<int>(out.refusal));
    fail_safes |= out.safety.active;
  };
  fly_course(rig);
  EXPECT_EQ(states.size(), 6u);  // all but kDisengaging
  EXPECT_GE(phases.size(), 9u);
  EXPECT_GE(refusals.size(), 3u);
  for (const FailSafe expected :
       {FailSafe::kPoseStale, FailSafe::kHeightStale, FailSafe::kSetpointStale, FailSafe::kComputerSilent,
        FailSafe::kObstacleAhead, FailSafe::kImuGap, FailSafe::kEStop})
    EXPECT_NE(fail_safes >> static_cast<unsigned>(expected) & 1U, 0u) << static_cast<int>(expected);
  EXPECT_TRUE(rig.stands());
}

TEST(CoreReplay, ARecordedFlightGivesTheSameBits) {
  const std::vector<CoreTraceRecord> trace = course();
  EXPECT_GT(trace.size(), 30000u);
  const auto difference = replay(trace);
  EXPECT_FALSE(difference) << difference->field << " in step " << difference->step;
}

TEST(CoreReplay, OtherParametersAreSeenAndNamed) {
  AutopilotParams other;
  other.cascade.tilt_slew_rad_s *= 0.999F;
  const auto difference = replay(course(), other);
  ASSERT_TRUE(difference);
  EXPECT_EQ(difference->field, "rotor speed");
}

TEST(CoreReplay, APerturbedBitIsSeenInItsStep) {
  std::vector<CoreTraceRecord> trace = course();
  std::size_t at = 0;
  std::uint32_t steps = 0;
  for (; steps < 5000; ++at) steps += trace[at].kind == CoreTraceRecord::Kind::kStep ? 1 : 0;
  CoreTraceRecord& record = trace[at - 1];
  record.estimate[1] = std::nextafter(record.estimate[1], 100.0F);
  const auto difference = replay(trace);
  ASSERT_TRUE(difference);
  EXPECT_EQ(difference->step, 5000u);
  EXPECT_EQ(difference->field, "position");
  EXPECT_EQ(difference->index, 1u);
  EXPECT_NE(difference->recorded, difference->replayed);
}

TEST(CoreReplay, AMissingRecordIsSeen) {
  std::vector<CoreTraceRecord> trace = course();
  trace.erase(trace.begin() + 700);
  const auto difference = replay(trace);
  ASSERT_TRUE(difference);
  EXPECT_EQ(difference->field, "sequence");
  EXPECT_EQ(difference->recorded, 702u);
  EXPECT_EQ(difference->replayed, 701u);
}

/// Every field of the inputs comes back, also those that a flight does not set.
TEST(CoreReplay, InputsComeBackBitByBit) {
  AutopilotInputs inputs;
  inputs.now = Time{123'456'789'012'345};
  InertialReading<float> imu{Time{inputs.now.ns - 5'000'000'000}, {1, 2, 3}, {4, 5, 6}, {}};
  imu.R_world_imu.emplace();
  *imu.R_world_imu << 1, 2, 3, 4, 5, 6, 7, 8, 9;
  inputs.imu = imu;
  PoseReading<float> pose{Time{-7}, {7, 8, 9}, {}};
  pose.covariance.emplace();
  *pose.covariance << 10, 11, 12, 13, 14, 15, 16, 17, 18;
  inputs.pose = pose;
  inputs.height = BasicHeightReading<float>{Time{9}, 19, 20.0F};
  FlightCommand command{Time{10}, 200, CommandKind::kSignOfLife, FlightPhase::kTouchDown, false};
  command.position_m = {21, 22, 23}, command.velocity_m_s = {24, 25, 26},
  command.acceleration_m_s2 = {27, 28, 29};
  command.yaw_rad = 30, command.roll_rad = 31, command.pitch_rad = 32, command.yaw_rate_rad_s = 33;
  command.thrust_ratio = 34;
  inputs.command = command;
  inputs.motors_on = inputs.computer_alive = true;
  inputs.rc_enabled = false;
  inputs.battery_ratio = 35, inputs.clearance_m = 36, inputs.obstacle_m = 37;

  CoreRecorder recorder;
  CoreInputReader reader;
  const auto back = [&](const AutopilotInputs& given) {
    const AutopilotInputs* result = nullptr;
    for (const CoreTraceRecord& record : recorder.inputs(given))
      result = reader.add(*decode_core_trace(encode(record)));
    return result;
  };
  const AutopilotInputs* read = back(inputs);
  ASSERT_NE(read, nullptr);
  EXPECT_EQ(read->now, inputs.now);
  ASSERT_TRUE(read->imu && read->pose && read->height && read->command);
  EXPECT_EQ(read->imu->stamp, imu.stamp);
  EXPECT_EQ(read->imu->angular_velocity_rad_s, imu.angular_velocity_rad_s);
  EXPECT_EQ(read->imu->specific_force_m_s2, imu.specific_force_m_s2);
  EXPECT_EQ(*read->imu->R_world_imu, *imu.R_world_imu);
  EXPECT_EQ(read->pose->stamp, pose.stamp);
  EXPECT_EQ(read->pose->x_y_yaw, pose.x_y_yaw);
  EXPECT_EQ(*read->pose->covariance, *pose.covariance);
  EXPECT_EQ(read->height->stamp, Time{9});
  EXPECT_EQ(read->height->height_m, 19);
  EXPECT_EQ(read->height->std_m, 20.0F);
  const FlightCommand& c = *read->command;
  EXPECT_EQ(std::tuple(c.stamp, c.pilot, c.kind, c.mode, c.dead_man),
            std::tuple(Time{10}, 200, CommandKind::kSignOfLife, FlightPhase::kTouchDown, false));
  EXPECT_EQ(c.position_m, command.position_m);
  EXPECT_EQ(c.velocity_m_s, command.velocity_m_s);
  EXPECT_EQ(c.acceleration_m_s2, command.acceleration_m_s2);
  EXPECT_EQ(std::tuple(c.yaw_rad, c.roll_rad, c.pitch_rad, c.yaw_rate_rad_s, c.thrust_ratio),
            std::tuple(30.0F, 31.0F, 32.0F, 33.0F, 34.0F));
  EXPECT_TRUE(read->motors_on && read->computer_alive && !read->rc_enabled);
  EXPECT_EQ(std::tuple(read->battery_ratio, read->clearance_m, read->obstacle_m),
            std::tuple(std::optional(35.0F), std::optional(36.0F), std::optional(37.0F)));

  inputs = {};  // nothing of one step remains in the next
  read = back(inputs);
  ASSERT_NE(read, nullptr);
  EXPECT_FALSE(read->imu || read->pose || read->height || read->command || read->battery_ratio ||
               read->clearance_m || read->obstacle_m || read->motors_on || read->computer_alive);
  EXPECT_TRUE(read->rc_enabled);
}

TEST(CoreReplay, OutputsOfABoardComeBack) {
  AutopilotOutputs out;
  out.stamp = Time{5};
  out.motors = MotorDemand::kControl;
  out.rotor_speed_rad_s = {1, 2, 3, 4};
  out.rpyt = {5, 6, 7, 8};
  out.state = AutopilotState::kError;
  out.phase = FlightPhase::kDescend;
  out.safety = {SafetyAction::kLand, FailSafe::kTiltMismatch, 0x80001U};
  out.tilt_mismatch_rad = 9.0F;
  out.refusal = Refusal::kBackwardStamp;
  out.invalid_inputs = 0xffffffffU;
  BasicVehicleState<float> state;
  state.height_ready = true;
  state.position_m = {1, 2, 3}, state.velocity_m_s = {4, 5, 6}, state.roll_pitch_yaw_rad = {7, 8, 9};
  const auto back = read_core_outputs(*decode_core_trace(encode(core_outputs_record(out, state, 3))));
  ASSERT_TRUE(back);
  const AutopilotOutputs& o = back->outputs;
  EXPECT_EQ(std::tuple(o.stamp, o.motors, o.rotor_speed_rad_s, o.state, o.phase),
            std::tuple(out.stamp, out.motors, out.rotor_speed_rad_s, out.state, out.phase));
  EXPECT_EQ(std::tuple(o.rpyt.roll_rad, o.rpyt.pitch_rad, o.rpyt.yaw_rate_rad_s, o.rpyt.thrust_ratio),
            std::tuple(5.0F, 6.0F, 7.0F, 8.0F));
  EXPECT_EQ(std::tuple(o.safety.action, o.safety.reason, o.safety.active),
            std::tuple(out.safety.action, out.safety.reason, out.safety.active));
  EXPECT_EQ(std::tuple(o.tilt_mismatch_rad, o.refusal, o.invalid_inputs),
            std::tuple(out.tilt_mismatch_rad, out.refusal, out.invalid_inputs));
  EXPECT_FALSE(back->planar_ready);
  EXPECT_TRUE(back->height_ready);
  EXPECT_EQ(back->position_m, state.position_m);
  EXPECT_EQ(back->velocity_m_s, state.velocity_m_s);
  EXPECT_EQ(back->roll_pitch_yaw_rad, state.roll_pitch_yaw_rad);
  EXPECT_FALSE(read_core_outputs(CoreTraceRecord{}));
}

}  // namespace
}  // namespace hm
