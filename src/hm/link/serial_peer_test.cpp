#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hm/link/mavlink_peer.hpp"
#include "hm/link/testing/pipe_transport.hpp"
#include "hm/link/testing/plugged_terminal.hpp"
#include "hm/link/transport/serial_port.hpp"
#include "hm/link/vehicle_server.hpp"

/// MAVLink over a serial line that is unplugged and plugged in again.
namespace hm {
namespace {

/// The device's end of a pseudo-terminal.
class DeviceSide : public Transport {
 public:
  explicit DeviceSide(link_testing::PluggedTerminal& terminal) : terminal_(terminal) {}
  std::size_t read(std::span<std::uint8_t> buffer) override {
    if (terminal_.is_plugged() && waiting_.empty()) waiting_ = terminal_.receive();
    const std::size_t count = std::min(buffer.size(), waiting_.size());
    const auto end = waiting_.begin() + static_cast<std::ptrdiff_t>(count);
    std::copy(waiting_.begin(), end, buffer.begin());
    waiting_.erase(waiting_.begin(), end);
    return count;
  }
  bool write(std::span<const std::uint8_t> bytes) override {
    if (terminal_.is_plugged()) terminal_.send(bytes);
    return terminal_.is_plugged();
  }
  bool wait(Duration) override { return false; }
  [[nodiscard]] bool is_datagram() const override { return false; }
  [[nodiscard]] bool is_open() const override { return terminal_.is_plugged(); }
  [[nodiscard]] std::string name() const override { return "device"; }

 private:
  link_testing::PluggedTerminal& terminal_;
  std::vector<std::uint8_t> waiting_;
};

/// A ground station on a serial port, and a vehicle whose clock is 100 s ahead at the other end.
class SerialPeers : public ::testing::Test {
 protected:
  void SetUp() override {
    auto opened = SerialPort::open(terminal.path(), 921600);
    ASSERT_TRUE(opened) << to_string(opened.error());
    port = std::move(*opened);
    station.emplace(*port, link_testing::station_options());
    MavlinkPeerOptions options;
    options.address = {1, 1};
    options.heartbeat.autopilot = kMavAutopilotPx4;
    vehicle.emplace(device, options);
    server.emplace(*vehicle, std::vector<LinkParameter>{},
                   [this](const MavCommandLong&, const CommandOrigin&) -> std::uint8_t {
                     ++commands_done;
                     return kMavAccepted;
                   });
  }
  /// Both ends every 10 ms of their clocks, whatever the machine's clock says; false if it never comes true.
  bool run_until(const std::function<bool()>& done) {
    constexpr int kMostSteps = 6000;
    for (int i = 0; i < kMostSteps; ++i) {
      if (done()) return true;
      now.ns += 10'000'000;
      port->wait(Duration{2'000'000});
      station->step([this] { return now; }, [](const MavlinkFrame&) {});
      const Time theirs = now + Duration{kAhead};
      vehicle->step([&] { return theirs; },
                    [&](const MavlinkFrame& frame) { server->receive(frame, theirs); });
      server->step(theirs);
    }
    return false;
  }
  void expect_both_ways() {
    EXPECT_TRUE(run_until([&] { return station->autopilot(now) != nullptr; }));
    MavCommandLong land;
    land.target_system = land.target_component = 1;
    land.command = kMavCommandLand;
    ASSERT_TRUE(station->commands().send(land));
    EXPECT_TRUE(run_until([&] { return station->commands().state() != CommandSender::State::kWaiting; }));
    EXPECT_EQ(station->commands().state(), CommandSender::State::kAnswered);
    const Time asked = now;
    EXPECT_TRUE(run_until([&] { return now - asked > Duration{1'500'000'000}; }));
    ASSERT_TRUE(station->time_sync().offset_at(now));
    EXPECT_NEAR(station->time_sync().offset_at(now)->seconds(), 100, 0.03);
  }

  static constexpr std::int64_t kAhead = 100'000'000'000;
  Time now;
  link_testing::PluggedTerminal terminal;
  DeviceSide device{terminal};
  std::unique_ptr<SerialPort> port;
  std::optional<MavlinkPeer> station, vehicle;
  std::optional<VehicleServer> server;
  int commands_done = 0;
};

TEST_F(SerialPeers, TalkAgainAfterTheLineWasUnplugged) {
  expect_both_ways();
  for (int round = 1; round <= 2; ++round) {
    // The plug is pulled within a frame.
    MavlinkBytes bytes{};
    write_mavlink_frame(make_mavlink_frame(vehicle->heartbeat(), {1, 1}, 0), bytes);
    terminal.send(std::span(bytes).first(9));
    EXPECT_TRUE(run_until([&, ticks = 0]() mutable { return ++ticks > 3; }));
    terminal.unplug();
    EXPECT_TRUE(run_until([&] { return station->autopilot(now) == nullptr; }));
    EXPECT_FALSE(port->is_open());
    EXPECT_GT(station->unsent(), 0U);
    terminal.plug_in();
    expect_both_ways();
    EXPECT_EQ(port->reconnections(), round);
    EXPECT_EQ(commands_done, round + 1);
    EXPECT_GT(station->autopilot(now)->lost_frames, 0U);
    EXPECT_EQ(vehicle->remotes(now + Duration{kAhead}).size(), 1U);
  }
}

}  // namespace
}  // namespace hm
