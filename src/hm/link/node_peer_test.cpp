#include <gtest/gtest.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "hm/core/testing/source_folder.hpp"
#include "hm/link/codec/mavlink_enums.hpp"
#include "hm/link/mavlink_peer.hpp"
#include "hm/link/testing/random_messages.hpp"
#include "hm/link/transport/udp_socket.hpp"
#include "hm/link/vehicle_messages.hpp"

/// Live over UDP against another implementation (tests/link/node_peer.js), which also judges ODOMETRY as PX4
/// and ArduPilot do. Skipped without node and node-mavlink; mavlink_vectors_test.cpp checks its bytes without
/// them.
namespace hm {
namespace {

namespace fs = std::filesystem;

Time steady_now() {
  return Time{std::chrono::duration_cast<std::chrono::nanoseconds>(
                  std::chrono::steady_clock::now().time_since_epoch())
                  .count()};
}

/// The folder node_modules with node-mavlink: HM_NODE_MODULES, or that of tests/link, which `./hm test`
/// fills.
fs::path node_modules() {
  const char* given = std::getenv("HM_NODE_MODULES");
  const fs::path folder = given ? fs::path(given) : test::source_folder() / "tests/link/node_modules";
  return fs::exists(folder / "node-mavlink") ? folder : fs::path();
}

/// How long the other process is waited for: only a failure takes so long.
constexpr double kPatience_s = 60;

class NodePeer : public ::testing::Test {
 protected:
  void SetUp() override {
    if (node_modules().empty() || std::system("node --version > /dev/null 2>&1") != 0)
      GTEST_SKIP() << "no node or no node-mavlink: npm ci --prefix tests/link (or HM_NODE_MODULES)";
    auto socket = UdpSocket::listen("127.0.0.1", 0);
    ASSERT_TRUE(socket);
    way = std::move(*socket);
    const std::string command = "NODE_PATH='" + node_modules().string() + "' node '" +
                                (test::source_folder() / "tests/link/node_peer.js").string() + "' live " +
                                std::to_string(way->port());
    process = ::popen(command.c_str(), "w");  // it ends with its standard input
    ASSERT_NE(process, nullptr);
    MavlinkPeerOptions options;
    options.address = {1, 191};
    options.heartbeat.type = kMavTypeOnboardController;
    options.heartbeat.autopilot = kMavAutopilotInvalid;
    options.timesync_period = Duration{50'000'000};
    peer = std::make_unique<MavlinkPeer>(*way, options);
    ASSERT_TRUE(run_until([&] { return peer->autopilot(now()) != nullptr; }, kPatience_s));
  }
  void TearDown() override {
    if (process) ::pclose(process);
  }
  /// The peer's clock; a slower one lets it wait longer for answers.
  [[nodiscard]] Time now() const { return Time{steady_now().ns / slowed}; }
  bool run_until(const std::function<bool()>& done, double seconds) {
    const Time start = steady_now();
    while (!done() && (steady_now() - start).seconds() < seconds) {
      way->wait(Duration{5'000'000});
      peer->step([this] { return now(); }, [&](const MavlinkFrame& frame) { frames.push_back(frame); });
    }
    return done();
  }
  /// The verdict on an ODOMETRY.
  std::string judged(const MavOdometry& message) {
    frames.clear();
    peer->send(message);
    std::string verdict;
    run_until(
        [&] {
          for (const MavlinkFrame& frame : frames)
            if (const auto text = read_mavlink_message<MavStatusText>(frame)) verdict = text->text.data();
          return !verdict.empty();
        },
        kPatience_s);
    return verdict;
  }

  std::unique_ptr<UdpSocket> way;
  std::unique_ptr<MavlinkPeer> peer;
  std::FILE* process = nullptr;
  std::vector<MavlinkFrame> frames;
  std::int64_t slowed = 1;
};

/// Random fields without NaN and with letters, since node's numbers and texts keep no others.
struct PlainFields {
  Rng& rng;
  template <class Field>
  void field(std::string_view name, Field& value) {
    if constexpr (WireType<Field>::kCount == 0) {
      set(name, value);
    } else {
      for (auto& element : value) set(name, element);
    }
  }
  template <class Field>
  void extension(std::string_view name, Field& value) {
    field(name, value);
  }
  template <class T>
  void set(std::string_view name, T& value) {
    if constexpr (std::is_same_v<T, float>)
      value = static_cast<float>(rng.uniform(-100, 100));
    else if constexpr (std::is_same_v<T, char>)
      value = static_cast<char>('a' + rng.below(26));
    else
      link_testing::RandomFields{rng}.field(name, value);
  }
};

TEST_F(NodePeer, EveryMessageIsReadAndSentBackByTheOtherImplementation) {
  Rng rng(11);
  MavlinkMessages::for_each([&]<class Message>() {
    Message message;
    Message::visit(message, PlainFields{rng});
    const MavlinkFrame sent = make_mavlink_frame(message, {1, 77}, 0);
    const auto bytes = link_testing::wire_bytes(sent);
    frames.clear();
    ASSERT_TRUE(way->write(bytes));
    const auto echo = [&]() -> const MavlinkFrame* {
      for (const MavlinkFrame& frame : frames)
        if (frame.message == Message::kId && frame.from == MavlinkAddress{2, 77}) return &frame;
      return nullptr;
    };
    ASSERT_TRUE(run_until([&] { return echo() != nullptr; }, kPatience_s)) << Message::kName;
    EXPECT_EQ(echo()->payload, sent.payload) << Message::kName;
  });
}

TEST_F(NodePeer, OdometryIsAcceptedByTheRulesOfPx4AndArduPilot) {
  LinkState state;
  state.stamp = Time{1'000'000'000};
  EXPECT_EQ(judged(*to_odometry(state)), "px4 accepted, ardupilot accepted");
  state.stamp = Time{1'020'000'000};
  state.pose_covariance = Mat6(Mat6::Identity() * 0.01);
  EXPECT_EQ(judged(*to_odometry(state)), "px4 accepted, ardupilot accepted");

  MavOdometry wrong = *to_odometry(state);
  wrong.time_usec += 1000;
  wrong.estimator_type = kMavEstimatorLidar;
  EXPECT_EQ(judged(wrong), "px4 wrong estimator type, ardupilot accepted");
  wrong.time_usec += 1000;
  wrong.estimator_type = kMavEstimatorVision;
  wrong.frame_id = kMavFrameLocalNed;
  EXPECT_EQ(judged(wrong), "px4 accepted, ardupilot wrong frame");
  wrong.frame_id = 4;  // ENU
  EXPECT_EQ(judged(wrong), "px4 wrong frame, ardupilot wrong frame");
  wrong.frame_id = kMavFrameLocalFrd;
  wrong.child_frame_id = 4;
  EXPECT_EQ(judged(wrong), "px4 wrong child frame, ardupilot wrong frame");
  // Stamps that go back, or come twice.
  EXPECT_EQ(judged(*to_odometry(state)), "px4 old stamp, ardupilot old stamp");
}

TEST_F(NodePeer, CommandsAreRepeatedUntilTheyAreAcknowledged) {
  slowed = 5;  // 2.5 s until the first repetition, 12 s until it gives up
  MavCommandLong command;
  command.target_system = 2;
  command.target_component = 1;
  command.command = kMavCommandArmDisarm;
  ASSERT_TRUE(peer->commands().send(command));
  EXPECT_TRUE(
      run_until([&] { return peer->commands().state() != CommandSender::State::kWaiting; }, kPatience_s));
  EXPECT_EQ(peer->commands().state(), CommandSender::State::kAnswered);
  EXPECT_EQ(peer->commands().result(), kMavAccepted);
}

TEST_F(NodePeer, ClocksAreRelated) {
  ASSERT_TRUE(run_until([&] { return peer->time_sync().offset_at(now()).has_value(); }, kPatience_s));
  // Both clocks count from the start of the machine; the other one adds 1000 s.
  EXPECT_NEAR(peer->time_sync().offset_at(steady_now())->seconds(), 1000, 0.1);
}

}  // namespace
}  // namespace hm
