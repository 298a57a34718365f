#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "hm/io/bytes/json.hpp"
#include "hm/station/station.hpp"
#include "hm/station/testing/station_rig.hpp"
#include "hm/station/web/access_rules.hpp"

namespace hm {
namespace {

using testing::HasSubstr;
using testing::Not;

/// Close frame that a connection ends with.
WebClient::Message end_of(WebClient& client) {
  while (const auto message = client.read_message())
    if (message->opcode == 8) return *message;
  return {};
}

class PublicStation : public testing::Test {
 protected:
  PublicStation() {
    StationOptions options = test_options();
    options.address = "0.0.0.0";
    station = start_station(std::move(options));
    const std::string url = station->url();
    token = url.substr(url.find("token=") + 6);
  }
  std::unique_ptr<Station> station;
  std::string token;
};

TEST(StationAccess, LoopbackNeedsNoTokenOtherAddressesDo) {
  const auto local = start_station();
  EXPECT_FALSE(local->is_public());
  EXPECT_EQ(local->url(), fmt::format("http://127.0.0.1:{}/", port_of(*local)));
}

TEST_F(PublicStation, HasATokenOf128BitsThatIsNewEachTime) {
  EXPECT_TRUE(station->is_public());
  EXPECT_EQ(token.size(), 32u);
  EXPECT_EQ(token.find_first_not_of("0123456789abcdef"), std::string::npos);
  StationOptions options = test_options();
  options.address = "0.0.0.0";
  EXPECT_THAT(start_station(std::move(options))->url(), Not(HasSubstr(token)));
}

TEST_F(PublicStation, GivesNothingButThePageWithoutTheToken) {
  WebClient client(port_of(*station));
  EXPECT_EQ(client.get("/").status, 200);
  EXPECT_EQ(client.get("/api/status").status, 403);
  EXPECT_THAT(client.get("/api/status").body, HasSubstr("the token is missing"));
  EXPECT_THAT(client.get("/api/status?token=" + std::string(32, '0')).body, HasSubstr("the token is wrong"));
  EXPECT_EQ(client.get("/api/mesh.ply?token=" + token.substr(0, 31)).status, 403);
  EXPECT_EQ(client.get("/api/status?token=" + token + "0").status, 403);
  EXPECT_EQ(client.get("/api/status?x=1&token=" + token).status, 200);
  for (const std::string path : {"/live", "/pilot", "/foxglove"}) {
    WebClient socket(port_of(*station));
    ASSERT_EQ(socket.upgrade(path + "?token=1").status, 101);
    const auto end = end_of(socket);
    EXPECT_EQ(end.code(), 1008);
    EXPECT_THAT(end.reason(), HasSubstr("the token is wrong"));
  }
  WebClient socket(port_of(*station));
  ASSERT_EQ(socket.upgrade("/live?token=" + token).status, 101);
  EXPECT_EQ(read_until(socket, LiveKind::kHello).sequence, 1u);
}

TEST(StationAccess, NamesThatAreNotThisMachinesAreRefused) {
  const auto station = start_station();
  const std::string port = std::to_string(port_of(*station));
  for (const std::string& host :
       std::vector<std::string>{"evil.com", "evil.com:" + port, "127.0.0.1.evil.com", "localhost.evil.com",
                                "[::1", "127.0.0.1:x", "127.0.0.1:123456", "evil.com\tx", ""}) {
    WebClient client(port_of(*station));
    client.send_raw("GET /api/status HTTP/1.1\r\nHost: " + host + "\r\n\r\n");
    const int status = client.read_response().status;
    EXPECT_TRUE(status == 403 || status == 400) << host << " " << status;
    WebClient socket(port_of(*station));
    EXPECT_NE(socket.upgrade("/live", "", host.empty() ? " " : host).status, 101) << host;
  }
  WebClient nameless(port_of(*station));
  nameless.send_raw("GET /api/status HTTP/1.1\r\n\r\n");
  EXPECT_EQ(nameless.read_response().status, 403);
  for (const std::string& host :
       std::vector<std::string>{"localhost:" + port, "LOCALHOST", "127.0.0.1:" + port, "[::1]:" + port,
                                "192.168.1.7", machine_name() + ":" + port}) {
    WebClient client(port_of(*station));
    client.send_raw("GET /api/status HTTP/1.1\r\nHost: " + host + "\r\n\r\n");
    EXPECT_EQ(client.read_response().status, 200) << host;
  }
}

TEST(StationAccess, PagesOfOtherOriginsAreRefused) {
  const auto station = start_station();
  const auto upgrade = [&](const std::string& path, const std::string& origin) {
    WebClient client(port_of(*station));
    return client.upgrade(path, "Origin: " + origin + "\r\nSec-WebSocket-Protocol: foxglove.sdk.v1\r\n")
        .status;
  };
  const std::string own = fmt::format("http://127.0.0.1:{}", port_of(*station));
  for (const std::string path : {"/live", "/pilot", "/foxglove"}) {
    EXPECT_EQ(upgrade(path, own), 101) << path;
    for (const std::string origin :
         {"http://evil.com", "null", "https://127.0.0.1", "http://127.0.0.1", "file://"})
      EXPECT_EQ(upgrade(path, origin), 403) << path << " " << origin;
  }
  EXPECT_EQ(upgrade("/foxglove", "https://app.foxglove.dev"), 101);
  EXPECT_EQ(upgrade("/live", "https://app.foxglove.dev"), 403);
  EXPECT_EQ(upgrade("/pilot", "https://app.foxglove.dev"), 403);
}

TEST(StationAccess, PagesOfOtherOriginsGetNothingOfTheApi) {
  const auto station = start_station();
  const auto status = [&](const std::string& path, const std::string& origin) {
    WebClient client(port_of(*station));
    return client.get(path, origin.empty() ? "" : "Origin: " + origin + "\r\n");
  };
  for (const std::string path : {"/api/status", "/api/statistics", "/api/mesh.ply"}) {
    for (const std::string origin :
         {"http://evil.com", "null", "http://127.0.0.1", "https://app.foxglove.dev"})
      EXPECT_EQ(status(path, origin).status, 403) << path << " " << origin;
    EXPECT_THAT(status(path, "http://evil.com").body, HasSubstr("pages of 'http://evil.com'"));
  }
  EXPECT_EQ(status("/api/status", "").status, 200);
  EXPECT_EQ(status("/api/status", fmt::format("http://127.0.0.1:{}", port_of(*station))).status, 200);
}

TEST(StationAccess, AnswersTellTheBrowserWhatItMayDo) {
  const auto station = start_station();
  WebClient client(port_of(*station));
  for (const std::string path : {"/", "/api/status", "/nothing"}) {
    const std::string header = client.get(path).header;
    EXPECT_THAT(header, HasSubstr("Content-Security-Policy: default-src 'none'; script-src 'self'"));
    EXPECT_THAT(header, HasSubstr("frame-ancestors 'none'"));
    EXPECT_THAT(header, HasSubstr("X-Content-Type-Options: nosniff"));
    EXPECT_THAT(header, HasSubstr("Referrer-Policy: no-referrer"));
    EXPECT_THAT(header, Not(HasSubstr("Access-Control-Allow")));
  }
}

TEST(StationAccess, OnlyFilesOfThePageAreServedWhateverThePath) {
  const auto station = start_station();
  WebClient client(port_of(*station));
  for (const std::string path :
       {"/../etc/passwd", "/%2e%2e/%2e%2e/etc/passwd", "//etc/passwd", "/etc/passwd", "/index.html/..", "/..",
        "/.", "/%00", "/index.html%00.js", "/\\..\\x", "/api/..", "/api/../status", "/api/%2e%2e/x", "/api/",
        "/api", "http://127.0.0.1/etc", "*", "/live"})
    EXPECT_EQ(client.get(path).status, 404) << path;
}

TEST(StationAccess, OnlyGetAndHeadAreServed) {
  const auto station = start_station();
  for (const std::string method : {"POST", "PUT", "DELETE", "OPTIONS", "TRACE", "CONNECT", "PATCH", "BREW"}) {
    WebClient client(port_of(*station));
    EXPECT_EQ(client.get("/", "", method).status, 405) << method;
  }
  WebClient client(port_of(*station));
  const auto head = client.get("/api/status", "", "HEAD");
  EXPECT_EQ(head.status, 200);
  EXPECT_THAT(head.header, HasSubstr("Content-Length: "));
  EXPECT_EQ(client.get("/api/status").status, 200);  // nothing of a body came in between
}

TEST(StationAccess, RequestsThatAreTooLongOrNoneAreRefused) {
  const auto station = start_station();
  const auto answer = [&](const std::string& bytes) {
    WebClient client(port_of(*station));
    client.send_raw(bytes);
    return client.read_response().status;
  };
  const std::string host = "Host: 127.0.0.1\r\n";
  EXPECT_EQ(answer("GET / HTTP/1.1\r\n" + host + "X: " + std::string(9000, 'x') + "\r\n\r\n"), 431);
  EXPECT_EQ(answer("GET /" + std::string(3000, 'x') + " HTTP/1.1\r\n" + host + "\r\n"), 414);
  EXPECT_EQ(answer("GET / HTTP/1.1\r\n" + host + "Content-Length: 5\r\n\r\nhello"), 400);
  EXPECT_EQ(answer("GET / HTTP/1.1\r\n" + host + "Transfer-Encoding: chunked\r\n\r\n0\r\n\r\n"), 400);
  EXPECT_EQ(answer("\x16\x03\x01 nonsense\r\n\r\n"), 400);
  EXPECT_EQ(answer("GET / HTTP/9.9\r\n\r\n"), 400);
  EXPECT_EQ(answer(std::string(100'000, 'A')), 431);
}

class Viewer : public testing::Test {
 protected:
  /// Close frame after what a viewer sends.
  template <class Send>
  WebClient::Message after(const Send& send) {
    WebClient client(port_of(*station));
    EXPECT_EQ(client.upgrade("/live").status, 101);
    client.send_text(R"({"type":"hello","protocol":1})");
    send(client);
    return end_of(client);
  }
  std::unique_ptr<Station> station = start_station();
};

TEST_F(Viewer, ThatBreaksTheProtocolIsEndedWithTheReason) {
  EXPECT_EQ(after([](auto& client) { client.send_frame(2, "binary"); }).code(), 1003);
  EXPECT_EQ(after([](auto& client) { client.send_text("{"); }).code(), 1002);
  EXPECT_EQ(after([](auto& client) { client.send_text(R"({"type":"ack","sequence":99})"); }).reason(),
            "ack of a frame that was not sent");
  EXPECT_EQ(after([](auto& client) { client.send_text(std::string(65'537, ' ')); }).code(), 1009);
  EXPECT_EQ(after([](auto& client) {
              for (int i = 0; i < 20; ++i)
                client.send_frame(i == 0 ? 1 : 0, std::string(4000, ' '), true, i == 19);
            }).code(),
            1009);
  EXPECT_EQ(after([](auto& client) { client.send_frame(1, R"({"type":"ack","sequence":1})", false); }).code(),
            1002);
  EXPECT_EQ(after([](auto& client) { client.send_frame(11, "reserved"); }).code(), 1002);
  EXPECT_EQ(after([](auto& client) { client.send_text("\xff\xfe\xfd"); }).code(), 1007);
  EXPECT_EQ(after([](auto& client) { client.send_frame(9, std::string(126, 'x')); }).code(), 1002);
}

/// What `/api/status` says was refused for a reason.
std::int64_t count_of_refused(std::uint16_t port, const std::string& token, const std::string& reason) {
  WebClient client(port);
  const auto answer = client.get("/api/status" + token);
  const auto status = parse_json(answer.body, "status");
  if (!status || !status->find("refused")) return -1;
  const auto* count = status->find("refused")->find_as<std::int64_t>(reason);
  return count ? *count : -1;
}

TEST_F(Viewer, ThatIsRefusedIsCountedByTheReason) {
  const auto port = port_of(*station);
  const auto refused = [&](const std::string& reason) { return count_of_refused(port, "", reason); };
  for (const auto name : RefusalCounts::kNames) EXPECT_EQ(refused(std::string(name)), 0) << name;
  after([](auto& client) { client.send_text("{"); });
  after([](auto& client) { client.send_frame(11, "reserved"); });
  EXPECT_TRUE(wait_until([&] { return refused("message") == 2; }));
  after([](auto& client) { client.send_text(std::string(65'537, ' ')); });
  EXPECT_TRUE(wait_until([&] { return refused("too_big") == 1; }));
  after([](auto& client) {
    for (int i = 0; i < 1000; ++i)
      client.send_text(R"({"type":"view","position":[0,0,0],"direction":[1,0,0]})");
  });
  EXPECT_TRUE(wait_until([&] { return refused("too_many") == 1; }));
  EXPECT_EQ(refused("message"), 2);
  WebClient(port).get("/api/status", "Origin: http://evil.com\r\n");
  WebClient(port).upgrade("/live", "Origin: http://evil.com\r\n");
  EXPECT_EQ(refused("origin"), 2);
  WebClient(port).upgrade("/live", "", "evil.com");
  EXPECT_EQ(refused("host"), 1);
  WebClient(port).get("/", "", "POST");
  EXPECT_EQ(refused("request"), 1);
  EXPECT_EQ(refused("token"), 0);
}

TEST_F(PublicStation, CountsRequestsWithoutTheToken) {
  WebClient client(port_of(*station));
  client.get("/api/status");
  WebClient socket(port_of(*station));
  socket.upgrade("/live?token=1");
  end_of(socket);
  EXPECT_TRUE(
      wait_until([&] { return count_of_refused(port_of(*station), "?token=" + token, "token") == 2; }));
}

TEST_F(Viewer, CannotPilot) {
  const auto end = after([](auto& client) {
    client.send_text(R"({"type":"command","sequence":1,"kind":"take_off","age_ms":0,"expires_ms":1000})");
  });
  EXPECT_EQ(end.code(), 1002);
  EXPECT_EQ(end.reason(), "type 'command' is not known");
}

TEST_F(Viewer, ThatSaysTooMuchIsEnded) {
  const auto end = after([](auto& client) {
    for (int i = 0; i < 1000; ++i) client.send_text(R"({"type":"ack","sequence":1})");
  });
  EXPECT_EQ(end.code(), 1008);
  EXPECT_THAT(end.reason(), HasSubstr("more than 100 messages a second"));
}

TEST_F(Viewer, MayBeOneOfSixteen) {
  std::vector<std::unique_ptr<WebClient>> clients;
  for (int i = 0; i < 16; ++i) {
    clients.push_back(std::make_unique<WebClient>(port_of(*station)));
    ASSERT_EQ(clients.back()->upgrade("/live").status, 101);
    read_until(*clients.back(), LiveKind::kHello);
  }
  EXPECT_EQ(station->viewers(), 16u);
  WebClient late(port_of(*station));
  ASSERT_EQ(late.upgrade("/live").status, 101);
  const auto end = end_of(late);
  EXPECT_EQ(end.code(), 1013);
  EXPECT_EQ(end.reason(), "16 viewers are connected already");
  EXPECT_EQ(count_of_refused(port_of(*station), "", "full"), 1);
  clients.pop_back();
  EXPECT_TRUE(wait_until([&] { return station->viewers() == 15; }));
  WebClient next(port_of(*station));
  ASSERT_EQ(next.upgrade("/live").status, 101);
  EXPECT_EQ(read_until(next, LiveKind::kHello).sequence, 1u);
}

TEST(StationStart, APortThatIsTakenIsNamed) {
  const auto first = start_station();
  StationOptions options = test_options();
  options.port = port_of(*first);
  const auto second = Station::start(options);
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, ErrorCode::kInternal);
  EXPECT_EQ(to_string(second.error()),
            fmt::format("127.0.0.1:{}: another program listens on this port", port_of(*first)));
}

TEST(StationStart, WithoutAPortTheNextFreeOneIsTaken) {
  StationOptions options = test_options();
  options.port_given = false;
  const auto first = start_station(options), second = start_station(options);
  EXPECT_GE(port_of(*first), 8710);
  EXPECT_GT(port_of(*second), port_of(*first));
}

TEST(StationStart, WhatIsNoAddressOfThisMachineIsNamed) {
  for (const std::string address : {"nowhere", "1.2.3.4", "127.0.0.1:80"}) {
    StationOptions options = test_options();
    options.address = address;
    const auto station = Station::start(options);
    ASSERT_FALSE(station) << address;
    EXPECT_EQ(station.error().code, ErrorCode::kUsage);
    EXPECT_THAT(to_string(station.error()), HasSubstr(address));
  }
}

}  // namespace
}  // namespace hm
