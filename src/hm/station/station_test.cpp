#include "hm/station/station.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <string>
#include <utility>

#include "hm/io/bytes/json.hpp"
#include "hm/station/live_frames.hpp"
#include "hm/station/testing/station_rig.hpp"
#include "hm/station/testing/web_client.hpp"

namespace hm {
namespace {

using testing::HasSubstr;

TEST(Station, AViewerGetsHelloAndThenWhatThereIs) {
  const auto station = start_station();
  PoseFrame pose;
  pose.position_m = {1, 2, 3};
  station->store().put(LiveKind::kPose, 0, Time{7}, to_payload(pose));
  station->store().add_event(Time::from_seconds(2), "warning", "too fast");
  WebClient client(port_of(*station));
  ASSERT_EQ(client.upgrade("/live").status, 101);
  const LiveMessage hello = read_until(client, LiveKind::kHello);
  EXPECT_EQ(hello.sequence, 1u);
  EXPECT_THAT(std::get<JsonFrame>(hello.frame).text, HasSubstr(R"("program":"housemartin 1.2.3")"));
  client.send_text(R"({"type":"hello","protocol":1})");
  const LiveMessage first = read_until(client, LiveKind::kPose);
  EXPECT_EQ(first.stamp, Time{7});
  EXPECT_EQ(std::get<PoseFrame>(first.frame).position_m, Vec3(1, 2, 3));
  EXPECT_EQ(std::get<JsonFrame>(read_until(client, LiveKind::kEvent).frame).text,
            R"({"id":1,"time_s":2.0,"level":"warning","text":"too fast"})");
  pose.position_m = {4, 5, 6};
  station->store().put(LiveKind::kPose, 0, Time{8}, to_payload(pose));
  EXPECT_EQ(std::get<PoseFrame>(read_until(client, LiveKind::kPose).frame).position_m, Vec3(4, 5, 6));
  EXPECT_EQ(station->viewers(), 1u);
}

TEST(Station, AnswersStatus) {
  const auto station = start_station();
  station->store().put(LiveKind::kTelemetry, 0, {}, text_bytes(R"({"state":"running"})"));
  WebClient client(port_of(*station));
  const auto status = client.get("/api/status");
  EXPECT_EQ(status.status, 200);
  EXPECT_THAT(status.body, HasSubstr(R"("telemetry":{"state":"running"},"viewers":0)"));
  const auto json = parse_json(status.body, "status");
  ASSERT_TRUE(json);
  EXPECT_GT(json->find("memory")->number_at("process", 0), 1e6);
  EXPECT_GE(json->find("memory")->number_at("heap", -1), 0);
  const auto missing = client.get("/api/mesh.ply");
  EXPECT_EQ(missing.status, 404);
  EXPECT_EQ(missing.body, "/api/mesh.ply: there is no such file here\n");
}

TEST(Station, AnswersStatisticsWithTheParameters) {
  const auto station = start_station();
  WebClient client(port_of(*station));
  EXPECT_EQ(client.get("/api/statistics").body, "{}\n");
  station->store().put(LiveKind::kStatistics, 0, {}, text_bytes(R"({"time_s":1.5})"));
  station->store().put(LiveKind::kStatistics, kParametersSlot, {}, text_bytes(R"({"parameters":"x = 1"})"));
  EXPECT_EQ(client.get("/api/statistics").body, R"({"time_s":1.5,"parameters":"x = 1"})"
                                                "\n");
}

struct AcceptingFlight : PilotHandler {
  void take(const PilotOrder& order) override {
    station->answer(order.sequence, order.kind == "land", "in flight");
  }
  void hold(const std::string&) override { ++holds; }
  Station* station = nullptr;
  std::atomic<int> holds = 0;
};

/// Next text on `/pilot` but pings, which are answered.
std::string read_pilot_text(WebClient& client) {
  while (const auto message = client.read_message()) {
    if (message->opcode != 1) return message->reason();
    const auto json = parse_json(message->data, "message");
    if (*json->find("type")->as_string() != "ping") return message->data;
    client.send_text(
        fmt::format(R"({{"type":"pong","sequence":{}}})", *json->find("sequence")->as_integer()));
  }
  return "end";
}

TEST(Station, APilotFliesOverTheSocket) {
  AcceptingFlight flight;
  StationOptions options = test_options();
  options.pilot = &flight;
  const auto station = start_station(std::move(options));
  flight.station = station.get();
  {
    WebClient client(port_of(*station));
    ASSERT_EQ(client.upgrade("/pilot").status, 101);
    EXPECT_EQ(read_pilot_text(client), R"({"type":"lease","holder":"none"})");
    client.send_text(R"({"type":"take","force":false})");
    EXPECT_EQ(read_pilot_text(client), R"({"type":"lease","holder":"you"})");
    client.send_text(R"({"type":"command","sequence":7,"kind":"land","age_ms":5,"expires_ms":1000})");
    EXPECT_EQ(read_pilot_text(client),
              R"({"type":"answer","sequence":7,"accepted":true,"reason":"in flight"})");
    client.send_text(R"({"type":"command","sequence":8,"kind":"velocity","age_ms":5,"expires_ms":300,)"
                     R"("velocity_m_s":[0,0,1],"yaw_rad_s":0})");
    EXPECT_EQ(read_pilot_text(client),
              R"({"type":"answer","sequence":8,"accepted":false,"reason":"in flight"})");
    EXPECT_EQ(flight.holds, 0);
    WebClient other(port_of(*station));
    EXPECT_THAT(other.get("/api/status").body, HasSubstr(R"("command":1})"));
  }
  for (int i = 0; i < 200 && flight.holds == 0; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_EQ(flight.holds, 1);
}

TEST(Station, WithoutAVehicleThereIsNothingToFly) {
  const auto station = start_station();
  WebClient client(port_of(*station));
  ASSERT_EQ(client.upgrade("/pilot").status, 101);
  const auto end = client.read_message();
  ASSERT_TRUE(end);
  EXPECT_EQ(end->code(), 1008);
  EXPECT_EQ(end->reason(), "there is nothing to fly here");
}

}  // namespace
}  // namespace hm
