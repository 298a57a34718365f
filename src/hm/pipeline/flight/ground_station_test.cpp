#include "hm/pipeline/flight/ground_station.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "hm/link/mavlink_key.hpp"
#include "hm/link/testing/pipe_transport.hpp"

namespace hm {
namespace {

/// A ground station at the other end of a way in memory, and what it heard.
class Flown : public testing::Test {
 protected:
  Flown() : site_(WorldKind::kRoom, 1) {
    station_.emplace(way_.station, link_testing::station_options());
    FlightRunParams params;
    start_in(WorldKind::kRoom, params.run);
    run_.emplace(site_, params);
    link_.emplace(way_.vehicle);
  }

  void hear(const MavlinkFrame& frame) {
    ++heard_[frame.message];
    if (const auto position = read_mavlink_message<MavLocalPositionNed>(frame)) position_ = *position;
    if (const auto value = read_mavlink_message<MavParamValue>(frame)) parameters_.push_back(*value);
    if (const auto state = read_mavlink_message<MavExtendedSysState>(frame)) landed_ = state->landed_state;
    if (const auto ack = read_mavlink_message<MavCommandAck>(frame)) results_[ack->command] = ack->result;
    if (const auto text = read_mavlink_message<MavStatusText>(frame))
      texts_.emplace_back(text->text.data(), strnlen(text->text.data(), text->text.size()));
  }
  /// Flies until a condition holds; false after `limit_s`.
  bool fly_until(double limit_s, const std::function<bool()>& done) {
    const Duration end = run_->elapsed() + Duration::from_seconds(limit_s);
    while (run_->elapsed() < end) {
      if (done()) return true;
      if (sticks_ && run_->elapsed().ns % 50'000'000 == 0) station_->send(*sticks_);
      const FlightMoment& moment = run_->step(next_);
      next_ = link_->step(moment);
      station_->step([&] { return moment.stamp; }, [this](const MavlinkFrame& frame) { hear(frame); });
      if (const auto command = station_->commands().poll(moment.stamp)) station_->send(*command);
    }
    return done();
  }
  /// Result of a command.
  std::uint8_t ask(std::uint16_t command, float param1 = 0, float param7 = 0, float param2 = 0) {
    MavCommandLong message;
    message.target_system = message.target_component = 1;
    message.command = command;
    message.param1 = param1;
    message.param2 = param2;
    message.param7 = param7;
    EXPECT_TRUE(station_->commands().send(message));
    EXPECT_TRUE(
        fly_until(5, [&] { return station_->commands().state() == CommandSender::State::kAnswered; }));
    return station_->commands().result();
  }
  /// Result of DO_REPOSITION to a place of ours.
  std::uint8_t ask_to_go(const Vec3& position_m, std::uint8_t frame) {
    const Vec3 theirs = swap_world(position_m, AutopilotWorld::kLocalFrd);
    MavCommandInt message;
    message.target_system = message.target_component = 1;
    message.command = kMavCommandReposition;
    message.frame = frame;
    message.param4 = std::numeric_limits<float>::quiet_NaN();
    message.x = static_cast<std::int32_t>(std::lround(1e4 * theirs.x()));
    message.y = static_cast<std::int32_t>(std::lround(1e4 * theirs.y()));
    message.z = static_cast<float>(theirs.z());
    results_.clear();
    station_->send(message);
    EXPECT_TRUE(fly_until(5, [&] { return results_.contains(kMavCommandReposition); }));
    return results_[kMavCommandReposition];
  }
  [[nodiscard]] AutopilotState state() const { return run_->moment().autopilot.state; }
  [[nodiscard]] FlightPhase phase() const { return run_->moment().autopilot.phase; }
  bool take_off(float height_m) {
    const auto ready = [&] {
      return run_->moment().estimate.planar_ready && run_->moment().estimate.height_ready;
    };
    // Gyroscopes are calibrated after a second, too.
    if (!fly_until(10, ready) || fly_until(1.5, [] { return false; }) ||
        ask(kMavCommandArmDisarm, 1) != kMavAccepted)
      return false;
    if (!fly_until(5, [&] { return state() == AutopilotState::kIdle; })) return false;
    return ask(kMavCommandTakeoff, 0, height_m) == kMavAccepted &&
           fly_until(10, [&] { return phase() == FlightPhase::kPosition; });
  }

  FlightSite site_;
  link_testing::PipePair way_;
  std::optional<MavlinkPeer> station_;
  std::optional<FlightRun> run_;
  std::optional<GroundStation> link_;
  std::optional<FlightCommand> next_;
  std::optional<MavManualControl> sticks_;
  std::map<std::uint32_t, int> heard_;
  std::vector<MavParamValue> parameters_;
  std::map<std::uint16_t, std::uint8_t> results_;  // newest of each command
  std::vector<std::string> texts_;
  MavLocalPositionNed position_;
  int landed_ = 0;
};

TEST_F(Flown, AGroundStationSeesTheVehicleAndItsParameters) {
  station_->send(MavParamRequestList{});
  fly_until(3, [] { return false; });
  ASSERT_NE(station_->autopilot(run_->now()), nullptr);
  EXPECT_EQ(station_->autopilot(run_->now())->heartbeat.type, kMavTypeQuadrotor);
  EXPECT_EQ(station_->autopilot(run_->now())->lost_frames, 0u);
  EXPECT_THAT(parameters_, testing::SizeIs(3));
  EXPECT_THAT(heard_[MavAttitude::kId], testing::AllOf(testing::Ge(25), testing::Le(30)));
  EXPECT_GE(heard_[MavLocalPositionNed::kId], 10);
  EXPECT_GE(heard_[MavBatteryStatus::kId], 2);
  EXPECT_EQ(landed_, kMavOnGround);
}

TEST_F(Flown, ItArmsTakesOffFliesBySticksAndLands) {
  ASSERT_TRUE(take_off(1));
  EXPECT_EQ(ask(kMavCommandArmDisarm, 0), kMavTemporarilyRejected) << "motors stop on the ground only";
  EXPECT_THAT(texts_, testing::Contains("the vehicle flies: land first"));
  fly_until(2, [] { return false; });
  const Vec3 before = run_->moment().T_odom_base.translation();
  sticks_.emplace();
  sticks_->target = 1;
  sticks_->x = -300;  // backward
  sticks_->z = 500;   // in the middle
  fly_until(2.5, [] { return false; });
  EXPECT_EQ(phase(), FlightPhase::kVelocity);
  sticks_->x = 0;
  ASSERT_TRUE(fly_until(3, [&] { return phase() == FlightPhase::kHold; }));
  sticks_.reset();
  fly_until(2, [] { return false; });
  const Vec3 moved = run_->moment().T_odom_base.translation() - before;
  EXPECT_NEAR(moved.x(), -0.7, 0.2);
  EXPECT_NEAR(moved.y(), 0, 0.15);
  EXPECT_NEAR(moved.z(), 0, 0.1);
  // Forward, right, down.
  const Vec3 truth = run_->moment().T_odom_base.translation();
  EXPECT_NEAR(position_.x, truth.x(), 0.1);
  EXPECT_NEAR(position_.y, -truth.y(), 0.1);
  EXPECT_NEAR(position_.z, -truth.z(), 0.1);
  EXPECT_EQ(landed_, kMavInAir);
  ASSERT_EQ(ask(kMavCommandLand), kMavAccepted);
  ASSERT_TRUE(fly_until(20, [&] { return state() == AutopilotState::kIdle; }));
  ASSERT_EQ(ask(kMavCommandArmDisarm, 0), kMavAccepted);
  EXPECT_TRUE(fly_until(5, [&] { return state() == AutopilotState::kOff; }));
  EXPECT_EQ(run_->moment().collisions, 0u);
}

TEST_F(Flown, AGamepadThatFallsSilentEndsInHold) {
  ASSERT_TRUE(take_off(1));
  sticks_.emplace();
  sticks_->target = 1;
  sticks_->x = 300;
  sticks_->z = 500;
  ASSERT_TRUE(fly_until(3, [&] { return phase() == FlightPhase::kVelocity; }));
  sticks_.reset();
  EXPECT_TRUE(fly_until(1, [&] { return phase() == FlightPhase::kHold; }));
}

/// A goal of a ground station: forward, right, down.
MavSetPositionTargetLocalNed goal_of(const Vec3& position_m) {
  LinkSetPoint goal;
  goal.position_m = position_m;
  goal.yaw_rad = 0;
  auto message = to_position_target(goal, {}, {}, AutopilotWorld::kLocalFrd).value();
  message.target_system = message.target_component = 1;
  return message;
}

TEST_F(Flown, AGoalIsFlownToOnceHoweverOftenItIsSent) {
  ASSERT_TRUE(take_off(1));
  const Vec3 goal(-0.8, 0.3, 1.1);
  int orders = 0;
  for (int i = 0; i < 100; ++i) {  // at 20 Hz, as offboard programs send
    station_->send(goal_of(goal));
    fly_until(0.05, [&] {
      orders += next_ && next_->kind == CommandKind::kGoTo ? 1 : 0;
      return false;
    });
  }
  EXPECT_EQ(orders, 1);
  EXPECT_EQ(phase(), FlightPhase::kPosition);
  EXPECT_LT((run_->moment().T_odom_base.translation() - goal).norm(), 0.1);
}

/// The vehicle's side alone: what it makes of a moment.
TEST(GroundStationGoal, MovesWithTheMapWhileTheVehicleKeepsIt) {
  link_testing::PipePair way;
  MavlinkPeer station(way.station, link_testing::station_options());
  GroundStation link(way.vehicle);
  FlightMoment moment;
  moment.stamp = Time{1'000'000'000};
  moment.autopilot.state = AutopilotState::kFlying;
  moment.autopilot.phase = FlightPhase::kPosition;
  const auto step = [&] {
    moment.stamp = moment.stamp + Duration{1'000'000};
    const auto command = link.step(moment);
    moment.answer.reset();
    if (command) moment.answer = CommandAnswer{*command, Refusal::kNone};
    return command;
  };
  const auto goals_in = [&](int steps) {
    std::vector<FlightCommand> goals;
    for (int i = 0; i < steps; ++i)
      if (const auto command = step(); command && command->kind == CommandKind::kGoTo)
        goals.push_back(*command);
    return goals;
  };
  station.send(goal_of({1, 2, 1}));
  const auto first = goals_in(500);
  ASSERT_EQ(first.size(), 1U);
  EXPECT_LT((first[0].position_m - Vec3f(1, 2, 1)).norm(), 1e-5F);
  moment.T_map_odom = SE2(Vec2(0.2, -0.1), 0.03);  // a place seen again
  const auto again = goals_in(500);
  ASSERT_EQ(again.size(), 1U);
  EXPECT_LT((again[0].position_m - Vec3f(1, 2, 1)).norm(), 1e-5F) << "in the map it is the same";
  moment.T_map_odom = SE2(Vec2(0.2001, -0.1), 0.03);  // less than counts
  EXPECT_TRUE(goals_in(500).empty());
  // A fail-safe took the goal away: the correction must not bring it back.
  moment.autopilot.phase = FlightPhase::kHold;
  EXPECT_TRUE(goals_in(10).empty());
  moment.autopilot.phase = FlightPhase::kPosition;
  moment.T_map_odom = SE2(Vec2(0.5, -0.1), 0.03);
  EXPECT_TRUE(goals_in(500).empty());
}

TEST(SignedGroundStation, HearsAndIsHeardWithTheKeyOnly) {
  link_testing::PipePair way;
  MavlinkKey key{1, 2, 3}, wrong{1, 2, 4};
  GroundStation link(way.vehicle, {}, key);
  FlightMoment moment;
  moment.stamp = Time{1'000'000'000};
  const auto listens = [&](const std::optional<MavlinkKey>& theirs) {
    MavlinkPeer station(way.station, with_key(link_testing::station_options(), theirs));
    start_signing(station);
    MavCommandLong land;
    land.target_system = land.target_component = 1;
    land.command = kMavCommandLand;
    station.send(land);
    bool obeyed = false;
    for (int i = 0; i < 2000; ++i) {
      moment.stamp = moment.stamp + Duration{1'000'000};
      const auto command = link.step(moment);
      obeyed |= command && command->kind == CommandKind::kLand;
      station.step([&] { return moment.stamp; }, [](const MavlinkFrame&) {});
    }
    return std::pair(obeyed, station.autopilot(moment.stamp) != nullptr);
  };
  EXPECT_EQ(listens(std::nullopt), std::pair(false, true)) << "without a key everything is heard";
  EXPECT_EQ(listens(wrong), std::pair(false, false));
  EXPECT_EQ(listens(key), std::pair(true, true));
}

TEST_F(Flown, AGoalWhileAnotherPilotFliesIsRefusedOnce) {
  next_.emplace();
  next_->stamp = run_->now();
  next_->pilot = 1;
  next_->kind = CommandKind::kTakeOver;
  fly_until(0.2, [] { return false; });
  FlightMoment flying = run_->moment();
  flying.autopilot.state = AutopilotState::kFlying;
  flying.autopilot.phase = FlightPhase::kPosition;
  int orders = 0;
  for (int i = 0; i < 20; ++i) {
    station_->send(goal_of({1, 0, 1}));
    flying.stamp = flying.stamp + Duration{50'000'000};
    const auto command = link_->step(flying);
    flying.answer.reset();
    if (command && command->kind == CommandKind::kGoTo) ++orders;
    if (command) flying.answer = CommandAnswer{*command, Refusal::kOtherPilot};
  }
  EXPECT_EQ(orders, 1);
}

TEST_F(Flown, RefusalsAreToldInWords) {
  next_.emplace();
  next_->stamp = run_->now();
  next_->pilot = 1;
  next_->kind = CommandKind::kTakeOver;
  fly_until(0.2, [] { return false; });
  EXPECT_EQ(ask(kMavCommandArmDisarm, 1), kMavTemporarilyRejected);
  EXPECT_EQ(state(), AutopilotState::kOff);
  EXPECT_THAT(texts_, testing::Contains(testing::HasSubstr("take over")));
  // The first button takes control.
  MavManualControl pressed;
  pressed.target = 1;
  pressed.z = 500;
  pressed.buttons = 1;
  station_->send(pressed);
  fly_until(0.2, [] { return false; });
  EXPECT_EQ(ask(kMavCommandArmDisarm, 1), kMavAccepted);
  EXPECT_TRUE(fly_until(5, [&] { return state() == AutopilotState::kIdle; }));
}

TEST_F(Flown, ACommandIsAcknowledgedWithWhatTheCoreAnswers) {
  const auto ready = [&] { return run_->moment().estimate.planar_ready; };
  ASSERT_TRUE(fly_until(10, ready));
  EXPECT_EQ(ask(kMavCommandTakeoff, 0, 1), kMavTemporarilyRejected);
  EXPECT_THAT(texts_, testing::Contains("the motors are off: engage first"));
  texts_.clear();
  EXPECT_EQ(ask(kMavCommandLand), kMavTemporarilyRejected);
  EXPECT_EQ(ask(kMavCommandLoiter), kMavTemporarilyRejected);
  EXPECT_EQ(ask(kMavCommandReturn), kMavTemporarilyRejected);
  EXPECT_EQ(ask_to_go({1, 0, 1}, kMavFrameLocalNed), kMavTemporarilyRejected);
  EXPECT_EQ(texts_, std::vector<std::string>(4, "the vehicle does not fly"));
  constexpr std::uint8_t kGlobal = 0;
  EXPECT_EQ(ask_to_go({1, 0, 1}, kGlobal), kMavUnsupportedFrame);
  EXPECT_EQ(ask(kMavCommandReposition), kMavCommandIntOnly);
  texts_.clear();
  EXPECT_EQ(ask(kMavCommandArmDisarm, 0), kMavAccepted) << "they are off";
  EXPECT_EQ(ask(kMavCommandArmDisarm, 1), kMavAccepted);
  EXPECT_EQ(state(), AutopilotState::kEngaging);
  EXPECT_EQ(ask(kMavCommandArmDisarm, 1), kMavTemporarilyRejected);
  EXPECT_THAT(texts_, testing::Contains("the motors are being started or stopped: wait"));
}

TEST_F(Flown, ItFliesToPlacesHoldsAndReturns) {
  ASSERT_TRUE(take_off(1));
  const Vec3 goal(-0.8, 0.3, 1.1);
  ASSERT_EQ(ask_to_go(goal, kMavFrameLocalNed), kMavAccepted);
  const auto distance_m = [&] { return (run_->moment().T_odom_base.translation() - goal).norm(); };
  EXPECT_TRUE(fly_until(10, [&] { return distance_m() < 0.1; }));
  ASSERT_EQ(ask_to_go({0, 0, 1}, kMavFrameLocalFrd), kMavAccepted);
  EXPECT_EQ(phase(), FlightPhase::kPosition);
  ASSERT_EQ(ask(kMavCommandLoiter), kMavAccepted);
  EXPECT_EQ(phase(), FlightPhase::kHold);
  fly_until(3, [] { return false; });
  EXPECT_LT(distance_m(), 0.4) << "it stopped on the way";
  ASSERT_EQ(ask(kMavCommandReturn), kMavAccepted);
  EXPECT_EQ(phase(), FlightPhase::kReturn);
  ASSERT_TRUE(fly_until(30, [&] { return state() == AutopilotState::kIdle; }));
  EXPECT_LT(run_->moment().T_odom_base.translation().head<2>().norm(), 0.2);
}

TEST_F(Flown, TheEmergencyStopWorksInFlight) {
  ASSERT_TRUE(take_off(0.5F));
  EXPECT_EQ(ask(kMavCommandArmDisarm, 0, 0, 21196), kMavAccepted);
  EXPECT_TRUE(fly_until(0.5, [&] { return state() == AutopilotState::kError; }));
  EXPECT_EQ(ask(kMavCommandArmDisarm, 1), kMavTemporarilyRejected);
  EXPECT_THAT(texts_, testing::Contains(testing::HasSubstr("an error is latched")));
}

}  // namespace
}  // namespace hm
