#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "hm/core/json_value.hpp"
#include "hm/core/testing/source_folder.hpp"
#include "hm/io/bytes/json.hpp"
#include "hm/station/live_frames.hpp"
#include "hm/station/testing/station_rig.hpp"

/// Against another implementation of the protocol (tests/station/foxglove_client.js). Skipped without node
/// and @foxglove/ws-protocol, which `./hm test` fetches; foxglove_session_test.cpp needs neither.
namespace hm {
namespace {

namespace fs = std::filesystem;

fs::path node_modules() {
  const char* given = std::getenv("HM_NODE_MODULES");
  const fs::path folder = given ? fs::path(given) : test::source_folder() / "tests/station/node_modules";
  return fs::exists(folder / "@foxglove/ws-protocol") && fs::exists(folder / "ws") ? folder : fs::path();
}

std::string output_of(const std::string& command) {
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(::popen(command.c_str(), "r"), &::pclose);
  std::string text;
  std::array<char, 4096> bytes{};
  while (const auto got = std::fread(bytes.data(), 1, bytes.size(), pipe.get()))
    text.append(bytes.data(), got);
  return text;
}

void fill(LiveStore& store) {
  for (const auto which : {PoseFrame::Which::kCamera, PoseFrame::Which::kVehicle}) {
    PoseFrame pose;
    pose.which = which;
    pose.position_m = {1, 2, 3};
    store.put(LiveKind::kPose, static_cast<std::uint64_t>(which), Time{42}, to_payload(pose));
  }
  for (const auto which :
       {PathFrame::Which::kTrajectory, PathFrame::Which::kKeyframes, PathFrame::Which::kWayPoints})
    store.put(LiveKind::kPath, static_cast<std::uint64_t>(which), Time{43},
              to_payload(PathFrame{which, 0, 1, {{4, 5, 6}}}));
  for (const auto which : {ScanFrame::Which::kLaser, ScanFrame::Which::kObstacles})
    store.put(LiveKind::kScan, static_cast<std::uint64_t>(which), Time{44},
              to_payload(ScanFrame{which, {{3, 2, 3}}}));
  store.add_event(Time{45}, "info", "an event");
}

TEST(FoxglovePeer, ItsClientReadsEveryChannelInBothSubprotocols) {
  if (node_modules().empty() || std::system("node --version > /dev/null 2>&1") != 0)
    GTEST_SKIP() << "no node or no @foxglove/ws-protocol: npm ci --prefix tests/station (or HM_NODE_MODULES)";
  const auto station = start_station();
  fill(station->store());
  for (const std::string protocol : {"foxglove.websocket.v1", "foxglove.sdk.v1"}) {
    const std::string output = output_of(fmt::format(
        "NODE_PATH='{}' node '{}/tests/station/foxglove_client.js' ws://127.0.0.1:{}/foxglove {} 2>&1",
        node_modules().string(), test::source_folder().string(), port_of(*station), protocol));
    std::map<std::string, JsonValue> messages;
    for (std::size_t at = 0; at < output.size();) {
      const auto end = output.find('\n', at);
      const auto line = parse_json(output.substr(at, end - at), "line");
      ASSERT_TRUE(line) << output;
      if (const JsonValue* topic = line->find("topic")) messages[*topic->as_string()] = *line;
      at = end == std::string::npos ? output.size() : end + 1;
    }
    EXPECT_EQ(messages.size(), 10u) << output;
    EXPECT_EQ(messages["/camera/pose"].find("stamp_ns")->number_or(0), 42);
    EXPECT_EQ(messages["/trajectory"].find("message")->find("poses")->as_array()->size(), 1u);
    EXPECT_EQ(*messages["/obstacles"].find("schema")->as_string(), "foxglove.PointCloud");
    EXPECT_EQ(*messages["/log"].find("message")->find("message")->as_string(), "an event");
  }
}

}  // namespace
}  // namespace hm
