#include "hm/station/web/web_server.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "hm/station/testing/station_rig.hpp"

namespace hm {
namespace {

using testing::HasSubstr;

/// Says what it hears, and everything that it is given to say.
class Echo : public WebSocketSession {
 public:
  explicit Echo(std::atomic<int>& alive) : alive_(alive) { ++alive_; }
  ~Echo() override { --alive_; }
  WebOutput receive(std::string_view message, bool, Duration) override {
    if (message == "end") return WebClose{4000, "as asked"};
    heard_ = message;
    return {};
  }
  WebOutput next(Duration) override {
    if (heard_.empty()) return {};
    if (heard_ == "flood") return WebMessage::of_text(std::string(60'000, 'f'));
    WebMessage message = WebMessage::of_text(heard_);
    heard_.clear();
    return message;
  }

 private:
  std::atomic<int>& alive_;
  std::string heard_;
};

class EchoHandler : public WebHandler {
 public:
  void respond(const WebRequest& request, Answer answer) override {
    if (request.path == "/large") return answer(WebResponse::of_text(200, std::string(20'000'000, 'x')));
    if (request.path == "/never") return unanswered.push_back(std::move(answer));
    if (request.path == "/later") {
      later = std::thread([answer = std::move(answer)] { answer(WebResponse::of_text(200, "later")); });
      return;
    }
    answer(WebResponse::of_text(200, request.path + "?" + request.query));
  }
  std::variant<WebSocketOpening, WebResponse> open(const WebRequest&) override {
    return WebSocketOpening{std::make_unique<Echo>(alive), ""};
  }
  void tick(Duration) override { ++ticks; }
  void refused(Refused why) override { ++counts[static_cast<std::size_t>(why)]; }
  [[nodiscard]] int count(Refused why) const { return counts[static_cast<std::size_t>(why)]; }

  std::atomic<int> alive = 0, ticks = 0;
  std::array<std::atomic<int>, static_cast<std::size_t>(Refused::kEnd)> counts{};
  std::vector<Answer> unanswered;
  std::thread later;
};

class WebServerTest : public testing::Test {
 protected:
  /// Longer than a busy machine stalls a client.
  explicit WebServerTest(double patience_s = 1, WebLimits limits = {}) {
    limits.patience = Duration::from_seconds(patience_s);
    limits.messages_per_s = 1e6;
    auto started = WebServer::start({"127.0.0.1", 0, 1}, limits, handler);
    EXPECT_TRUE(started);
    server = std::move(*started);
  }
  ~WebServerTest() override {
    handler.unanswered.clear();
    if (handler.later.joinable()) handler.later.join();
  }
  EchoHandler handler;
  std::unique_ptr<WebServer> server;
};

TEST_F(WebServerTest, AnswersOneRequestAfterTheOtherOnAConnection) {
  WebClient client(server->port());
  EXPECT_EQ(client.get("/a?b=c").body, "/a?b=c");
  EXPECT_EQ(client.get("/later").body, "later");
  EXPECT_EQ(client.get("/d").body, "/d?");
  client.send_raw(
      "GET /1 HTTP/1.1\r\nHost: x\r\n\r\nGET /2 HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n");
  EXPECT_EQ(client.read_response().body, "/1?");
  EXPECT_EQ(client.read_response().body, "/2?");
  EXPECT_TRUE(client.wait_for_end());
}

TEST_F(WebServerTest, EchoesMessagesWholeAndInPieces) {
  WebClient client(server->port());
  ASSERT_EQ(client.upgrade("/").status, 101);
  client.send_text("one");
  EXPECT_EQ(client.read_message()->data, "one");
  client.send_frame(1, "t", true, false);
  client.send_frame(0, "wo", true, true);
  EXPECT_EQ(client.read_message()->data, "two");
  const std::string large(65'536, 'x');
  client.send_text(large);
  EXPECT_EQ(client.read_message()->data, large);
  client.send_text("end");
  const auto end = client.read_message();
  EXPECT_EQ(end->code(), 4000);
  EXPECT_EQ(end->reason(), "as asked");
}

TEST_F(WebServerTest, WhoSaysNothingIsEnded) {
  WebClient silent(server->port());
  EXPECT_TRUE(silent.wait_for_end());
  WebClient half(server->port());
  half.send_raw("GET / HTTP/1.1\r\nHo");
  EXPECT_TRUE(half.wait_for_end());
  EXPECT_TRUE(wait_until([&] { return server->connections() == 0; }));
  EXPECT_EQ(handler.count(Refused::kSilent), 2);
  WebClient idle(server->port());
  EXPECT_EQ(idle.get("/a").status, 200);
  EXPECT_TRUE(idle.wait_for_end());
  EXPECT_TRUE(wait_until([&] { return server->connections() == 0; }));
  EXPECT_EQ(handler.count(Refused::kSilent), 2) << "who was answered may leave";
  WebClient begun(server->port());
  EXPECT_EQ(begun.get("/a").status, 200);
  begun.send_raw("GET / HTTP/1.1\r\nHo");
  EXPECT_TRUE(begun.wait_for_end());
  EXPECT_TRUE(wait_until([&] { return handler.count(Refused::kSilent) == 3; }));
}

TEST_F(WebServerTest, AHeaderThatComesByDropsIsEnded) {
  WebClient client(server->port());
  std::atomic<bool> ended = false;
  std::thread drops([&] {
    for (int i = 0; i < 300 && !ended; ++i) {
      client.send_raw(i == 0 ? "GET / HTTP/1.1\r\nX: " : "x");
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  });
  EXPECT_TRUE(client.wait_for_end());
  ended = true;
  drops.join();
}

TEST_F(WebServerTest, AWebSocketThatVanishedIsEndedOneThatIsSilentIsNot) {
  WebClient alive(server->port()), vanished(server->port());
  ASSERT_EQ(alive.upgrade("/").status, 101);
  ASSERT_EQ(vanished.upgrade("/").status, 101);
  EXPECT_TRUE(wait_until([&] { return handler.alive == 2; }));
  std::thread pongs([&] {  // reads, thus answers pings
    const auto message = alive.read_message();
    EXPECT_EQ(message->data, "still here");
  });
  EXPECT_TRUE(wait_until([&] { return handler.alive == 1; }));
  std::this_thread::sleep_for(std::chrono::milliseconds(2000));
  EXPECT_EQ(handler.alive, 1);
  EXPECT_EQ(handler.count(Refused::kSilent), 1);
  alive.send_text("still here");
  pongs.join();
}

TEST_F(WebServerTest, AWebSocketThatReadsNothingIsEnded) {
  WebClient client(server->port(), 5, 4096);
  ASSERT_EQ(client.upgrade("/").status, 101);
  client.send_text("flood");
  EXPECT_TRUE(wait_until([&] { return handler.alive == 1; }));
  EXPECT_TRUE(wait_until([&] { return handler.alive == 0; }));
  EXPECT_EQ(handler.count(Refused::kSilent), 1);
}

TEST_F(WebServerTest, EndsWithAnswersThatAreOwed) {
  WebClient client(server->port());
  client.send_raw("GET /never HTTP/1.1\r\nHost: x\r\n\r\n");
  EXPECT_TRUE(wait_until([&] { return handler.ticks > 5 && server->connections() == 1; }));
  handler.unanswered.clear();
  server.reset();
  EXPECT_TRUE(client.wait_for_end());
}

TEST_F(WebServerTest, ALargeFileTakesAsLongAsItTakesUnlessNobodyReads) {
  WebClient slow(server->port());
  slow.send_raw("GET /large HTTP/1.1\r\nHost: x\r\n\r\n");
  for (int piece = 0; piece < 20; ++piece) {
    ASSERT_TRUE(slow.take(1'000'000)) << "piece " << piece;
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  WebClient stalled(server->port(), 5, 4096);
  stalled.send_raw("GET /large HTTP/1.1\r\nHost: x\r\n\r\n");
  EXPECT_TRUE(wait_until([&] { return server->connections() == 0; }));
  EXPECT_EQ(handler.count(Refused::kSilent), 1);
}

TEST_F(WebServerTest, ThisMachineMayAskAsOftenAsItLikes) {
  for (int load = 0; load < 60; ++load) {  // a page that is reloaded without a pause
    WebClient client(server->port());
    for (int request = 0; request < 10; ++request) ASSERT_EQ(client.get("/page.js").status, 200);
    WebClient socket(server->port());
    ASSERT_EQ(socket.upgrade("/").status, 101);
  }
  EXPECT_EQ(handler.count(Refused::kTooMany), 0);
}

class LimitedServerTest : public WebServerTest {
 protected:
  LimitedServerTest() : WebServerTest(5, limits()) {}
  static WebLimits limits() {
    WebLimits limits;
    limits.requests_per_s = 10;
    limits.loopback_is_limited = true;
    return limits;
  }
};

TEST_F(LimitedServerTest, WhoAsksTooOftenIsToldToWait) {
  int refused = 0;
  for (int i = 0; i < 100; ++i) {
    WebClient client(server->port());
    const auto answer = i % 10 == 9 ? client.upgrade("/") : client.get("/a");
    if (answer.status != 429) {
      EXPECT_EQ(answer.status, i % 10 == 9 ? 101 : 200) << i;
      continue;
    }
    ++refused;
    EXPECT_GE(i, 20) << "the burst of a page";
    EXPECT_THAT(answer.header, HasSubstr("Retry-After: 1\r\n"));
    EXPECT_EQ(answer.body, "more than 10 requests a second: try again in a second\n");
    EXPECT_TRUE(client.wait_for_end());
  }
  EXPECT_GT(refused, 0);
  EXPECT_EQ(handler.count(Refused::kTooMany), refused);
  std::this_thread::sleep_for(std::chrono::milliseconds(1100));
  for (int i = 0; i < 10; ++i) EXPECT_EQ(WebClient(server->port()).get("/a").status, 200);
}

class PatientServerTest : public WebServerTest {
 protected:
  PatientServerTest() : WebServerTest(30) {}
};

TEST_F(PatientServerTest, AThousandHalfOpenConnectionsAreInNobodysWay) {
  rlimit limit{};
  ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &limit), 0);
  limit.rlim_cur = std::min<rlim_t>(limit.rlim_max, 4096);
  ::setrlimit(RLIMIT_NOFILE, &limit);
  if (limit.rlim_cur < 2500) GTEST_SKIP() << "only " << limit.rlim_cur << " files may be open";
  WebClient before(server->port());
  ASSERT_EQ(before.upgrade("/").status, 101);
  std::vector<std::unique_ptr<WebClient>> half_open;
  for (int i = 0; i < 1000; ++i) {
    half_open.push_back(std::make_unique<WebClient>(server->port()));
    if (i % 2 == 0) half_open.back()->send_raw("GET / HT");
    if (i % 100 == 0) {
      before.send_text(std::to_string(i));
      EXPECT_EQ(before.read_message()->data, std::to_string(i));
    }
  }
  WebClient after(server->port());
  EXPECT_EQ(after.get("/still?here").body, "/still?here");
  EXPECT_TRUE(wait_until([&] { return server->connections() <= WebLimits{}.waiting + 3; }));
  EXPECT_GT(server->connections(), 100u);
  half_open.clear();
  before.send_text("alive");
  EXPECT_EQ(before.read_message()->data, "alive");
}

TEST_F(PatientServerTest, ConnectionsAreLimitedWhateverTheyAre) {
  std::vector<std::unique_ptr<WebClient>> clients;
  for (std::size_t i = 0; i < WebLimits{}.connections; ++i) {
    clients.push_back(std::make_unique<WebClient>(server->port()));
    ASSERT_EQ(clients.back()->upgrade("/").status, 101);
  }
  WebClient more(server->port());
  EXPECT_TRUE(more.wait_for_end());
  clients.pop_back();
  EXPECT_TRUE(wait_until([&] { return WebClient(server->port()).get("/again").status == 200; }));
}

TEST_F(PatientServerTest, RandomBytesHarmNothing) {
  std::uint32_t state = 1;
  const auto random = [&] { return state = state * 1664525 + 1013904223; };
  WebClient witness(server->port());
  ASSERT_EQ(witness.upgrade("/").status, 101);
  for (int round = 0; round < 200; ++round) {
    WebClient client(server->port());
    if (round % 2 == 0) {
      ASSERT_EQ(client.upgrade("/").status, 101);
    }
    std::string bytes(random() % 300, ' ');
    for (char& byte : bytes) byte = static_cast<char>(random() >> 24);
    client.send_raw(bytes);
  }
  witness.send_text("unharmed");
  EXPECT_EQ(witness.read_message()->data, "unharmed");
}

}  // namespace
}  // namespace hm
