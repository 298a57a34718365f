#include "hm/flight/fail_safes.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace hm {
namespace {

constexpr float kNoNumber = std::numeric_limits<float>::quiet_NaN();

Duration ms(int count) { return {std::int64_t{1'000'000} * count}; }

/// A vehicle in the air without any trouble.
SafetyInputs healthy(int now_ms) {
  SafetyInputs inputs;
  inputs.now = Time{} + ms(1000 + now_ms);
  inputs.airborne = true;
  inputs.position_std_m = 0.02F;
  inputs.battery_ratio = 0.8F;
  inputs.return_need_ratio = 0.15F;
  return inputs;
}

/// A row of the table: what goes wrong from 0 ms on (given the milliseconds since), and when it acts.
struct Row {
  FailSafe which;
  int after_ms;
  SafetyAction action;
  std::function<void(SafetyInputs&, int)> break_it;
};

std::vector<Row> rows() {
  return {
      {FailSafe::kPoseStale, 200, SafetyAction::kDeadReckoning,
       [](SafetyInputs& in, int t) { in.pose_age = ms(t); }},
      {FailSafe::kPoseLost, 1000, SafetyAction::kLevelDescent,
       [](SafetyInputs& in, int t) { in.pose_age = ms(t); }},
      {FailSafe::kPoseLost, 0, SafetyAction::kLevelDescent,
       [](SafetyInputs& in, int) { in.position_std_m = 0.51F; }},
      {FailSafe::kHeightStale, 500, SafetyAction::kSinkSlowly,
       [](SafetyInputs& in, int t) { in.height_age = ms(t); }},
      {FailSafe::kPoseRefused, 500, SafetyAction::kDeadReckoning,
       [](SafetyInputs& in, int t) { in.poses_refused = ms(t); }},
      {FailSafe::kSetpointStale, 300, SafetyAction::kHold,
       [](SafetyInputs& in, int t) { in.velocity_age = ms(t); }},
      {FailSafe::kSetpointStale, 100, SafetyAction::kHold,
       [](SafetyInputs& in, int t) { in.direct_age = ms(t); }},
      {FailSafe::kPilotLost, 2000, SafetyAction::kHold,
       [](SafetyInputs& in, int t) { in.pilot_age = ms(t); }},
      {FailSafe::kPilotGone, 10000, SafetyAction::kReturn,
       [](SafetyInputs& in, int t) { in.pilot_age = ms(t); }},
      {FailSafe::kComputerSilent, 1000, SafetyAction::kLevelDescent,
       [](SafetyInputs& in, int t) { in.computer_age = ms(t); }},
      {FailSafe::kBatteryForReturn, 1000, SafetyAction::kReturn,
       [](SafetyInputs& in, int) { in.battery_ratio = 0.14F; }},
      {FailSafe::kBatteryEmpty, 1000, SafetyAction::kLand,
       [](SafetyInputs& in, int) { in.battery_ratio = 0.09F; }},
      {FailSafe::kFenceAhead, 0, SafetyAction::kClamp,
       [](SafetyInputs& in, int) { in.stop_outside_m = 0.01F; }},
      {FailSafe::kFenceLeft, 0, SafetyAction::kReturn, [](SafetyInputs& in, int) { in.outside_m = 0.2F; }},
      {FailSafe::kFenceFarOutside, 0, SafetyAction::kLand,
       [](SafetyInputs& in, int) { in.outside_m = 1.0F; }},
      {FailSafe::kObstacleAhead, 0, SafetyAction::kBrake,
       [](SafetyInputs& in, int) {
         in.obstacle_m = 0.5F;
         in.stopping_distance_m = 0.6F;
       }},
      {FailSafe::kNoLift, 1000, SafetyAction::kLand,
       [](SafetyInputs& in, int) {
         in.thrust_saturated = true;
         in.climb_m_s = -0.4F;
       }},
      {FailSafe::kImuGap, 20, SafetyAction::kHoldMotors, [](SafetyInputs& in, int t) { in.imu_age = ms(t); }},
      {FailSafe::kImuLost, 100, SafetyAction::kCut, [](SafetyInputs& in, int t) { in.imu_age = ms(t); }},
      {FailSafe::kOverturned, 100, SafetyAction::kCut, [](SafetyInputs& in, int) { in.tilt_rad = 1.06F; }},
      {FailSafe::kUncontrolled, 400, SafetyAction::kCut,
       [](SafetyInputs& in, int) { in.cos_tilt_error = std::cos(0.53F); }},
      {FailSafe::kTiltMismatch, 3000, SafetyAction::kLand,
       [](SafetyInputs& in, int) { in.tilt_mismatch_rad = 0.8F; }},
      {FailSafe::kEStop, 0, SafetyAction::kCut, [](SafetyInputs& in, int) { in.e_stop = true; }},
  };
}

TEST(FailSafes, EachRowActsAtItsTimeOut) {
  for (const Row& row : rows()) {
    const std::string name = "fail-safe " + std::to_string(static_cast<int>(row.which));
    FailSafes guards;
    for (int t = -500; t < 0; ++t) ASSERT_EQ(guards.step(healthy(t)).active, 0u) << name;
    int acted_at = -1;
    for (int t = 0; t <= row.after_ms + 5 && acted_at < 0; ++t) {
      SafetyInputs inputs = healthy(t);
      row.break_it(inputs, t);
      if (guards.step(inputs).has(row.which)) acted_at = t;
    }
    EXPECT_NEAR(acted_at, row.after_ms, 1) << name;
    EXPECT_EQ(guards.verdict().action, row.action) << name;
    // It ends with its cause, but for the battery's: charge does not come back.
    const bool stays = row.which == FailSafe::kBatteryForReturn || row.which == FailSafe::kBatteryEmpty;
    EXPECT_EQ(guards.step(healthy(row.after_ms + 10)).active != 0, stays) << name;
    guards.reset();
    EXPECT_EQ(guards.step(healthy(row.after_ms + 11)).active, 0u) << name;
  }
}

/// The parameter of a row's time-out; null: it acts at once.
float FailSafeParams::*time_out_of(const Row& row) {
  switch (row.which) {
    case FailSafe::kPoseStale:
      return &FailSafeParams::pose_stale_s;
    case FailSafe::kPoseLost:
      return row.after_ms > 0 ? &FailSafeParams::pose_lost_s : nullptr;
    case FailSafe::kHeightStale:
      return &FailSafeParams::height_stale_s;
    case FailSafe::kPoseRefused:
      return &FailSafeParams::pose_refused_s;
    case FailSafe::kSetpointStale:
      return row.after_ms == 300 ? &FailSafeParams::velocity_stale_s : &FailSafeParams::direct_stale_s;
    case FailSafe::kPilotLost:
      return &FailSafeParams::pilot_lost_s;
    case FailSafe::kPilotGone:
      return &FailSafeParams::pilot_gone_s;
    case FailSafe::kComputerSilent:
      return &FailSafeParams::computer_silent_s;
    case FailSafe::kBatteryForReturn:
    case FailSafe::kBatteryEmpty:
      return &FailSafeParams::battery_after_s;
    case FailSafe::kNoLift:
      return &FailSafeParams::no_lift_s;
    case FailSafe::kImuGap:
      return &FailSafeParams::imu_gap_s;
    case FailSafe::kImuLost:
      return &FailSafeParams::imu_lost_s;
    case FailSafe::kOverturned:
      return &FailSafeParams::overturned_s;
    case FailSafe::kUncontrolled:
      return &FailSafeParams::uncontrolled_s;
    case FailSafe::kTiltMismatch:
      return &FailSafeParams::tilt_mismatch_s;
    default:
      return nullptr;
  }
}

TEST(FailSafes, EachTimeOutIsAParameter) {
  int varied = 0;
  for (const Row& row : rows()) {
    float FailSafeParams::*const time_out = time_out_of(row);
    ASSERT_EQ(time_out == nullptr, row.after_ms == 0) << static_cast<int>(row.which);
    if (time_out == nullptr) continue;
    FailSafeParams params;
    params.*time_out *= 1.5F;
    FailSafes guards(params);
    const int after_ms = row.after_ms * 3 / 2;
    for (int t = 0; t < after_ms + 100; ++t) {
      SafetyInputs inputs = healthy(t);
      row.break_it(inputs, t);
      if (t < after_ms) {
        ASSERT_FALSE(guards.step(inputs).has(row.which)) << static_cast<int>(row.which) << " after " << t;
      } else if (t > after_ms) {
        ASSERT_TRUE(guards.step(inputs).has(row.which)) << static_cast<int>(row.which) << " after " << t;
      } else {
        guards.step(inputs);  // rounding decides this one
      }
    }
    ++varied;
  }
  EXPECT_EQ(varied, 17);
}

TEST(FailSafes, ShortTroubleIsNone) {
  FailSafes guards;
  for (int t = 0; t < 20000; ++t) {  // a battery that sags for 0.9 s at a time, tilts of 90 ms
    SafetyInputs inputs = healthy(t);
    if (t % 1000 < 900) inputs.battery_ratio = 0.05F;
    if (t % 100 < 90) inputs.tilt_rad = 2;
    if (t % 3000 < 2900) inputs.tilt_mismatch_rad = 2.0F;
    ASSERT_EQ(guards.step(inputs).active, 0u) << t;
  }
}

TEST(FailSafes, TheWorstActionWins) {
  const std::vector<Row> all = rows();
  int pairs = 0;
  for (const Row& first : all) {
    for (const Row& second : all) {
      FailSafes guards;
      SafetyVerdict verdict;
      for (int t = 0; t <= 10000; t += 1) {
        SafetyInputs inputs = healthy(t);
        first.break_it(inputs, t);
        second.break_it(inputs, t);
        verdict = guards.step(inputs);
        if (verdict.has(first.which) && verdict.has(second.which)) break;
      }
      if (!verdict.has(first.which) || !verdict.has(second.which)) continue;  // two values of one input
      ++pairs;
      ASSERT_GE(verdict.action, first.action);
      ASSERT_GE(verdict.action, second.action);
      ASSERT_EQ(action_of(verdict.reason), verdict.action);
    }
  }
  EXPECT_GT(pairs, 450);  // of 484
}

TEST(FailSafes, OnTheGroundOnlyTheEmergencyStopCounts) {
  for (const Row& row : rows()) {
    FailSafes guards;
    for (int t = 0; t <= row.after_ms + 10; ++t) {
      SafetyInputs inputs = healthy(t);
      row.break_it(inputs, t);
      inputs.airborne = false;
      ASSERT_EQ(guards.step(inputs).active != 0, row.which == FailSafe::kEStop);
    }
    // Time on the ground does not count in the air.
    if (row.after_ms > 100 && row.which != FailSafe::kPoseStale) {
      SafetyInputs inputs = healthy(row.after_ms + 11);
      row.break_it(inputs, 0);
      EXPECT_EQ(guards.step(inputs).active, 0u);
    }
  }
}

TEST(FailSafes, NumbersThatAreNoneCountAsDangerous) {
  FailSafes guards;
  SafetyVerdict verdict;
  for (int t = 0; t <= 3000; ++t) {
    SafetyInputs inputs = healthy(t);
    inputs.position_std_m = inputs.stop_outside_m = inputs.outside_m = inputs.tilt_rad = kNoNumber;
    inputs.cos_tilt_error = kNoNumber;
    inputs.battery_ratio = inputs.tilt_mismatch_rad = inputs.obstacle_m = kNoNumber;
    inputs.thrust_saturated = true;
    inputs.climb_m_s = kNoNumber;
    verdict = guards.step(inputs);
  }
  for (const FailSafe which : {FailSafe::kPoseLost, FailSafe::kFenceAhead, FailSafe::kFenceFarOutside,
                               FailSafe::kObstacleAhead, FailSafe::kBatteryEmpty, FailSafe::kNoLift,
                               FailSafe::kOverturned, FailSafe::kUncontrolled, FailSafe::kTiltMismatch})
    EXPECT_TRUE(verdict.has(which)) << static_cast<int>(which);
}

/// Collects what visit() gives.
struct DocList {
  std::vector<std::string> names;
  bool in_range = true;
  void operator()(const ParamDoc& doc, float value) {
    names.emplace_back(doc.name);
    const auto number = static_cast<double>(value);
    in_range = in_range && number >= doc.range.min && number <= doc.range.max && !doc.help.empty();
  }
};

TEST(FailSafeParams, AllAreVisitedAndWithinTheirRange) {
  FailSafeParams params;
  DocList list;
  FailSafeParams::visit(params, list);
  EXPECT_EQ(list.names.size() * sizeof(float), sizeof(FailSafeParams));
  EXPECT_TRUE(list.in_range);
}

}  // namespace
}  // namespace hm
