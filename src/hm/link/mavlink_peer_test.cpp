#include "hm/link/mavlink_peer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "hm/link/testing/pipe_transport.hpp"
#include "hm/link/vehicle_server.hpp"

namespace hm {
namespace {

using link_testing::station_options;

MavlinkPeerOptions vehicle_options() {
  MavlinkPeerOptions options;
  options.address = {1, 1};
  options.heartbeat.type = kMavTypeQuadrotor;
  options.heartbeat.autopilot = kMavAutopilotPx4;
  return options;
}

/// A vehicle and a ground station in memory. The vehicle's clock is 100 s ahead.
class MavlinkPeers : public ::testing::Test {
 protected:
  MavlinkPeers() : MavlinkPeers(vehicle_options(), station_options()) {}
  MavlinkPeers(const MavlinkPeerOptions& vehicle_is, const MavlinkPeerOptions& station_is)
      : vehicle(way.vehicle, vehicle_is), station(way.station, station_is) {}
  /// Both ends every 10 ms.
  void run(double seconds) {
    for (int i = 0; i < std::lround(seconds * 100); ++i) {
      now.ns += 10'000'000;
      vehicle.step([&] { return now + Duration{kAhead}; },
                   [&](const MavlinkFrame& frame) {
                     server.receive(frame, now + Duration{kAhead});
                     at_vehicle.push_back(frame);
                   });
      server.step(now + Duration{kAhead});
      station.step([&] { return now; }, [&](const MavlinkFrame& frame) { at_station.push_back(frame); });
    }
  }
  template <class Message>
  std::vector<Message> received() const {
    std::vector<Message> messages;
    for (const MavlinkFrame& frame : at_station)
      if (const auto message = read_mavlink_message<Message>(frame)) messages.push_back(*message);
    return messages;
  }

  static constexpr std::int64_t kAhead = 100'000'000'000;
  Time now;
  link_testing::PipePair way;
  MavlinkPeer vehicle, station;
  int commands_done = 0;
  MavCommandLong last_command;
  std::optional<std::uint8_t> last_frame;
  VehicleServer server{vehicle,
                       {{"MPC_XY_P", 1.5F, 0, 3, false}, {"COM_MODE", 2, 0, 5, true}},
                       [this](const MavCommandLong& command, const CommandOrigin& origin) -> std::uint8_t {
                         ++commands_done;
                         last_command = command;
                         last_frame = origin.frame;
                         if (command.command == kMavCommandLand) return kMavInProgress;
                         return command.command == kMavCommandTakeoff ? kMavAccepted : kMavUnsupported;
                       }};
  std::vector<MavlinkFrame> at_vehicle, at_station;
};

TEST_F(MavlinkPeers, FindEachOtherByHeartbeats) {
  EXPECT_EQ(station.autopilot(now), nullptr);
  run(5.0);
  ASSERT_NE(station.autopilot(now), nullptr);
  EXPECT_EQ(station.autopilot(now)->address, (MavlinkAddress{1, 1}));
  EXPECT_EQ(vehicle.autopilot(now + Duration{kAhead}), nullptr);  // a ground station is none
  EXPECT_EQ(vehicle.remotes(now + Duration{kAhead}).size(), 1U);
  EXPECT_EQ(received<MavHeartbeat>().size(), 5U);
}

TEST_F(MavlinkPeers, ASilentOneIsGoneAfterItsTimeAndComesBack) {
  run(2.0);
  way.vehicle.lose = 1'000'000;
  run(1.9);  // the last one came at 1.01 s
  EXPECT_NE(station.autopilot(now), nullptr);
  run(0.2);
  EXPECT_EQ(station.autopilot(now), nullptr);
  way.vehicle.lose = 0;
  run(1.1);
  EXPECT_NE(station.autopilot(now), nullptr);
  EXPECT_GT(station.autopilot(now)->lost_frames, 0U);
}

TEST_F(MavlinkPeers, ClocksAreRelated) {
  run(20.0);
  ASSERT_TRUE(station.time_sync().offset_at(now));
  EXPECT_NEAR(station.time_sync().offset_at(now)->seconds(), 100, 0.011);
  EXPECT_NEAR(vehicle.time_sync().offset_at(now + Duration{kAhead})->seconds(), -100, 0.011);
}

TEST_F(MavlinkPeers, ACommandWhoseAnswerIsLostIsRepeatedAndDoneOnce) {
  run(1.5);
  MavCommandLong takeoff;
  takeoff.target_system = 1;
  takeoff.target_component = 1;
  takeoff.command = kMavCommandTakeoff;
  takeoff.param7 = 1.3F;
  ASSERT_TRUE(station.commands().send(takeoff));
  station.step([&] { return now; }, [](const MavlinkFrame&) {});
  way.vehicle.lose = 1;  // the first answer
  run(1.0);
  EXPECT_EQ(station.commands().state(), CommandSender::State::kAnswered);
  EXPECT_EQ(station.commands().result(), kMavAccepted);
  EXPECT_EQ(commands_done, 1);
  // The same command anew is done again.
  ASSERT_TRUE(station.commands().send(takeoff));
  run(1.0);
  EXPECT_EQ(commands_done, 2);
}

/// COMMAND_LONG of the station to the vehicle.
MavCommandLong to_vehicle(std::uint16_t kind) {
  MavCommandLong command;
  command.target_system = command.target_component = 1;
  command.command = kind;
  return command;
}

TEST_F(MavlinkPeers, ACommandThatTakesTimeIsAcknowledgedByItsEnd) {
  run(1.5);
  ASSERT_TRUE(station.commands().send(to_vehicle(kMavCommandLand)));
  run(0.1);
  EXPECT_TRUE(received<MavCommandAck>().empty());
  server.finish(kMavCommandLand, {255, 190}, kMavTemporarilyRejected);
  way.vehicle.lose = 1;
  server.finish(kMavCommandLand, {255, 190}, kMavAccepted);  // it has ended already
  way.vehicle.lose = 0;
  run(0.1);
  ASSERT_EQ(received<MavCommandAck>().size(), 1U);
  EXPECT_EQ(station.commands().state(), CommandSender::State::kAnswered);
  EXPECT_EQ(station.commands().result(), kMavTemporarilyRejected);
}

TEST_F(MavlinkPeers, AnEndThatIsLostIsToldAgainWithoutDoingTheCommandAgain) {
  run(1.5);
  ASSERT_TRUE(station.commands().send(to_vehicle(kMavCommandLand)));
  run(0.05);
  way.vehicle.lose = 1;
  server.finish(kMavCommandLand, {255, 190}, kMavAccepted);
  EXPECT_EQ(way.vehicle.lose, 0);
  run(1.0);
  EXPECT_EQ(station.commands().state(), CommandSender::State::kAnswered);
  EXPECT_EQ(station.commands().result(), kMavAccepted);
  EXPECT_EQ(commands_done, 1);
}

TEST_F(MavlinkPeers, ACommandWithoutAnEndIsInProgressThenFails) {
  run(1.5);
  ASSERT_TRUE(station.commands().send(to_vehicle(kMavCommandLand)));
  run(0.4);
  ASSERT_EQ(received<MavCommandAck>().size(), 1U);
  EXPECT_EQ(received<MavCommandAck>()[0].result, kMavInProgress);
  station.send(to_vehicle(kMavCommandLand));  // the same again, anew
  run(0.1);
  EXPECT_EQ(received<MavCommandAck>().back().result, kMavTemporarilyRejected);
  EXPECT_EQ(commands_done, 1);
  at_station.clear();
  run(2.0);
  ASSERT_EQ(received<MavCommandAck>().size(), 1U);
  EXPECT_EQ(received<MavCommandAck>()[0].result, kMavFailed);
  ASSERT_EQ(received<MavStatusText>().size(), 1U);
  EXPECT_STREQ(received<MavStatusText>()[0].text.data(), "the vehicle does not answer a command");
  station.send(to_vehicle(kMavCommandLand));
  run(0.1);
  EXPECT_EQ(commands_done, 2);
}

TEST_F(MavlinkPeers, ACommandWithAFrameHasItsPositionInMetres) {
  MavCommandInt command;
  command.target_system = command.target_component = 1;
  command.command = kMavCommandTakeoff;
  command.frame = kMavFrameLocalNed;
  command.param4 = 0.5F;
  command.x = 12'345;
  command.y = -20'000;
  command.z = -1.5F;
  station.send(command);
  run(0.1);
  ASSERT_EQ(received<MavCommandAck>().size(), 1U);
  EXPECT_EQ(received<MavCommandAck>()[0].result, kMavAccepted);
  EXPECT_EQ(last_frame, std::optional<std::uint8_t>(kMavFrameLocalNed));
  EXPECT_EQ(last_command.param4, 0.5F);
  EXPECT_FLOAT_EQ(last_command.param5, 1.2345F);
  EXPECT_FLOAT_EQ(last_command.param6, -2);
  EXPECT_EQ(last_command.param7, -1.5F);
}

TEST_F(MavlinkPeers, CommandsForOthersAreNotDone) {
  MavCommandLong command;
  command.target_system = 7;
  command.command = kMavCommandTakeoff;
  station.send(command);
  run(0.1);
  EXPECT_EQ(commands_done, 0);
}

TEST_F(MavlinkPeers, AGroundStationGetsWhatItAsksForFirst) {
  MavCommandLong request;
  request.target_system = 1;
  request.command = kMavCommandRequestMessage;
  request.param1 = 148;
  station.send(request);
  MavMissionRequestList mission;
  mission.target_system = 1;
  mission.target_component = 1;
  mission.mission_type = 1;
  station.send(mission);
  run(0.1);
  ASSERT_EQ(received<MavAutopilotVersion>().size(), 1U);
  // What it obeys, no more: no SET_ATTITUDE_TARGET.
  EXPECT_EQ(received<MavAutopilotVersion>()[0].capabilities,
            kMavCanMavlink2 | kMavCanParamFloat | kMavCanCommandInt | kMavCanSetPosition);
  ASSERT_EQ(received<MavCommandAck>().size(), 1U);
  EXPECT_EQ(received<MavCommandAck>()[0].result, kMavAccepted);
  ASSERT_EQ(received<MavMissionCount>().size(), 1U);
  EXPECT_EQ(received<MavMissionCount>()[0].count, 0);
  EXPECT_EQ(received<MavMissionCount>()[0].mission_type, 1);
}

TEST_F(MavlinkPeers, ParametersAreListedReadAndSet) {
  station.send(MavParamRequestList{1, 1});
  run(0.1);
  auto values = received<MavParamValue>();
  ASSERT_EQ(values.size(), 2U);
  EXPECT_STREQ(values[0].param_id.data(), "MPC_XY_P");
  EXPECT_EQ(values[0].param_value, 1.5F);
  EXPECT_EQ(values[1].param_count, 2);
  EXPECT_EQ(values[1].param_type, kMavParamInt32);
  MavParamSet set;
  set.target_system = set.target_component = 1;
  std::ranges::copy(std::string("COM_MODE"), set.param_id.begin());
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const float wrong : {7.0F, -1.0F, 2.5F, nan}) {
    set.param_value = wrong;
    at_station.clear();
    station.send(set);
    run(0.1);
    values = received<MavParamValue>();
    ASSERT_EQ(values.size(), 1U);
    EXPECT_EQ(values[0].param_value, 2) << wrong;
  }
  int changes = 0;
  server.parameters().changed = [&](const LinkParameter&) { ++changes; };
  set.param_value = 3;
  station.send(set);
  run(0.1);
  EXPECT_EQ(server.parameters().parameters()[1].value, 3);
  EXPECT_EQ(changes, 1);
  at_station.clear();
  MavParamRequestRead read;
  read.target_system = read.target_component = 1;
  read.param_index = 9;  // there is none
  station.send(read);
  read.param_index = -1;
  std::ranges::copy(std::string("COM_MODE"), read.param_id.begin());
  station.send(read);
  run(0.1);
  EXPECT_EQ(received<MavParamValue>().size(), 1U);
}

TEST_F(MavlinkPeers, LongTextsGoInNumberedParts) {
  vehicle.send_text(kMavWarning, "short");
  vehicle.send_text(kMavWarning, std::string(120, 'x'));
  run(0.1);
  const auto texts = received<MavStatusText>();
  ASSERT_EQ(texts.size(), 4U);
  EXPECT_EQ(texts[0].id, 0);
  EXPECT_STREQ(texts[0].text.data(), "short");
  EXPECT_NE(texts[1].id, 0);
  EXPECT_EQ(texts[3].chunk_seq, 2);
  EXPECT_EQ(std::string(texts[3].text.data()), std::string(20, 'x'));
}

TEST_F(MavlinkPeers, AFrameThatARouterSendsBackIsNotSomebodyElse) {
  run(1.0);
  const auto echo = make_mavlink_frame(vehicle.heartbeat(), {1, 1}, 9);
  MavlinkBytes bytes{};
  const std::size_t count = write_mavlink_frame(echo, bytes);
  way.vehicle.arrived.emplace_back(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(count));
  run(0.1);
  EXPECT_EQ(vehicle.remotes(now + Duration{kAhead}).size(), 1U);
}

class SignedMavlinkPeers : public MavlinkPeers {
 protected:
  static MavlinkPeerOptions with_key(MavlinkPeerOptions options, std::uint8_t first) {
    options.key.emplace()[0] = first;
    return options;
  }
  SignedMavlinkPeers() : MavlinkPeers(with_key(vehicle_options(), 1), with_key(station_options(), 1)) {}
};

TEST_F(SignedMavlinkPeers, OnlyThoseWithTheKeyAreHeard) {
  vehicle.set_signing_time(1'800'000'000'000'000);
  station.set_signing_time(1'800'000'000'000'000);
  run(2.0);
  EXPECT_NE(station.autopilot(now), nullptr);
  MavlinkPeer stranger(way.station, with_key(vehicle_options(), 2));
  stranger.set_signing_time(1'800'000'000'000'000);
  MavCommandLong takeoff;
  takeoff.command = kMavCommandTakeoff;
  stranger.send(takeoff);
  run(0.1);
  EXPECT_EQ(commands_done, 0);
  EXPECT_EQ(vehicle.counts().bad_signature, 1U);
}

}  // namespace
}  // namespace hm
