#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "hm/core/hash.hpp"
#include "hm/core/process_memory.hpp"
#include "hm/core/rng.hpp"
#include "hm/core/testing/memory_limit.hpp"
#include "hm/station/station.hpp"
#include "hm/station/testing/station_rig.hpp"

namespace hm {
namespace {

/// A page whose levels differ in size and contents, by its key and version.
void put_load_page(LiveStore& store, PageKey key, std::uint32_t version, std::size_t size) {
  PageLevels page;
  for (std::uint8_t level = 0; level < 3; ++level) {
    MeshPageFrame frame;
    frame.key = key;
    frame.version = version;
    frame.level = level;
    frame.vertex_bytes.resize(size >> (2 * level), static_cast<std::byte>(version * 3 + level));
    page.levels[level] = std::make_shared<const std::vector<std::byte>>(to_payload(frame));
  }
  page.center_m = Vec3(key.x, key.y, key.z);
  store.put_page(key, version, {}, std::move(page));
}

/// What a viewer shows of a page: all that decides about its picture.
struct LoadedPage {
  std::uint32_t version = 0;
  std::uint8_t level = 0;
  std::uint64_t vertices = 0;  ///< hash
};
using Model = std::map<PageKey, LoadedPage>;

std::uint64_t model_hash(const Model& model) {
  Fnv1a hash;
  for (const auto& [key, page] : model) {
    for (const auto number : {key.x, key.y, key.z}) hash.add(static_cast<std::uint64_t>(number));
    for (const std::uint64_t number : {std::uint64_t{page.version}, std::uint64_t{page.level}, page.vertices})
      hash.add(number);
  }
  return hash.value();
}

/// Shows a frame by the rules of the format.
void show(Model& model, const LiveFrame& frame) {
  if (const auto* gone = std::get_if<PageGoneFrame>(&frame)) {
    const auto page = model.find(gone->key);
    if (page != model.end() && page->second.version < gone->version) model.erase(page);
  } else if (const auto* page = std::get_if<MeshPageFrame>(&frame)) {
    const auto shown = model.find(page->key);
    const bool better = shown == model.end() || page->version > shown->second.version ||
                        (page->version == shown->second.version && page->level < shown->second.level);
    if (better) model[page->key] = {page->version, page->level, fnv1a(page->vertex_bytes)};
  }
}

/// A viewer on a thread, until its model is the true one.
class ModelViewer {
 public:
  struct Habits {
    int pause_ms = 0;        ///< after each frame
    int receive_buffer = 0;  ///< bytes
    int frames_a_visit = 0;  ///< then it goes, and comes back with what it knows; 0: stays
  };
  ModelViewer(std::uint16_t port, std::string session, const Habits& habits)
      : port_(port), session_(std::move(session)), habits_(habits), thread_([this] { run(); }) {}
  ~ModelViewer() { join(); }
  ModelViewer(const ModelViewer&) = delete;
  ModelViewer& operator=(const ModelViewer&) = delete;
  void join() {
    stop = true;
    if (thread_.joinable()) thread_.join();
  }
  std::atomic<std::uint64_t> expected = 0;  ///< hash of the true model, when it is known
  std::atomic<bool> stop = false, complete = false;
  std::uint64_t hash = 0;
  std::size_t bytes = 0, visits = 0;

 private:
  void run() {
    while (!stop && !complete) visit();
  }
  void visit() {
    ++visits;
    std::string known;
    for (const auto& [key, page] : model_)
      known += fmt::format("{}{},{},{},{},{}", known.empty() ? "" : ",", key.x, key.y, key.z, page.version,
                           page.level);
    LiveViewer viewer(port_, session_, known, habits_.receive_buffer);
    for (int count = 0; !stop && !complete && (habits_.frames_a_visit == 0 || count < habits_.frames_a_visit);
         ++count) {
      const auto message = viewer.next();
      if (!message) break;
      show(model_, message->frame);
      hash = model_hash(model_);
      complete = hash == expected;
      std::this_thread::sleep_for(std::chrono::milliseconds(habits_.pause_ms));
    }
    bytes += viewer.bytes();
  }

  std::uint16_t port_;
  std::string session_;
  Habits habits_;
  Model model_;
  std::thread thread_;
};

std::string session_of(const Station& station) {
  WebClient client(port_of(station));
  const auto status = client.get("/api/status").body;
  const auto at = status.find("\"session\":\"") + 11;
  return status.substr(at, status.find('"', at) - at);
}

TEST(StationLoad, FastAndSlowAndReturningViewersEndWithTheSameModel) {
  const auto station = start_station();
  const std::uint16_t port = port_of(*station);
  const std::string session = session_of(*station);
  ModelViewer fast(port, session, {}), slow(port, session, {8, 8192, 0}),
      returning(port, session, {1, 0, 25});
  Rng rng(4);
  Model truth;
  for (std::uint32_t version = 1; version <= 600; ++version) {
    const PageKey key{static_cast<std::int32_t>(rng.below(6)), static_cast<std::int32_t>(rng.below(6)), -1};
    if (rng.below(8) == 0) {
      station->store().remove_page(key, version, {});
      truth.erase(key);
    } else {
      const std::size_t size = 1000 + rng.below(30'000);
      put_load_page(station->store(), key, version, size);
      truth[key] = {version, 0, fnv1a(std::vector<std::byte>(size, static_cast<std::byte>(version * 3)))};
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  for (ModelViewer* viewer : {&fast, &slow, &returning}) viewer->expected = model_hash(truth);
  int polls = 0;
  EXPECT_TRUE(wait_until([&] {
    // Something to read for those that have everything already; ten times a second as a program does. At
    // every poll it would be more frames than the slow one reads, and urgent ones go before pages.
    if (polls++ % 20 == 0) station->store().put(LiveKind::kTelemetry, 0, {}, text_bytes("{}"));
    return fast.complete && slow.complete && returning.complete;
  }));
  for (ModelViewer* viewer : {&fast, &slow, &returning}) {
    viewer->join();
    EXPECT_EQ(viewer->hash, model_hash(truth));
  }
  EXPECT_LT(slow.bytes, fast.bytes);  // it missed states between
  EXPECT_GT(returning.visits, 1u);
}

TEST(StationLoad, AClientThatNeverReadsCostsNoMemoryAndHoldsNobodyUp) {
  const auto station = start_station();
  const std::uint16_t port = port_of(*station);
  std::vector<std::unique_ptr<WebClient>> stalled;
  for (int i = 0; i < 5; ++i) {
    stalled.push_back(std::make_unique<WebClient>(port, 1, 4096));
    ASSERT_EQ(stalled.back()->upgrade("/live").status, 101);
    stalled.back()->send_text(R"({"type":"hello","protocol":1})");
  }
  LiveViewer fast(port);
  const auto round = [&](std::uint32_t version) {
    for (int x = 0; x < 40; ++x) put_load_page(station->store(), {x, 0, 0}, version, 100'000);
    station->store().put(LiveKind::kPose, 0, Time{version}, to_payload(PoseFrame{}));
    // The viewer that reads gets each pose while the others stand still.
    while (const auto message = fast.next())
      if (message->kind == LiveKind::kPose && message->stamp == Time{version}) return true;
    return false;
  };
  std::uint32_t version = 0;
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(round(++version));
  EXPECT_EQ(station->viewers(), 6u);
  const std::size_t before = resident_bytes();
  for (int i = 0; i < 60; ++i) ASSERT_TRUE(round(++version));  // 0.3 GB of pages
  // A sanitizer keeps what was freed.
  if (test::kCanLimitMemory) {
    EXPECT_LT(resident_bytes(), before + 40'000'000);
  }
}

TEST(StationLoad, AViewerThatComesBackGetsOnlyWhatChanged) {
  const auto station = start_station();
  for (int x = 0; x < 30; ++x) put_load_page(station->store(), {x, 0, 0}, 1, 1000);
  std::string known;
  for (int x = 0; x < 30; ++x) known += fmt::format("{}{},0,0,1,0", x == 0 ? "" : ",", x);
  put_load_page(station->store(), {7, 0, 0}, 2, 1000);
  station->store().remove_page({8, 0, 0}, 2, {});
  WebClient client(port_of(*station), 0.3);
  ASSERT_EQ(client.upgrade("/live").status, 101);
  client.send_text(fmt::format(R"({{"type":"hello","protocol":1,"session":"{}","pages":[{}]}})",
                               session_of(*station), known));
  EXPECT_EQ(read_until(client, LiveKind::kHello).sequence, 1u);
  std::vector<LiveKind> kinds;
  while (const auto message = client.read_message())
    kinds.push_back(decode_live_message(message->bytes())->kind);
  EXPECT_THAT(kinds, testing::UnorderedElementsAre(LiveKind::kMeshPage, LiveKind::kPageGone));
}

TEST(StationApi, MakesFilesOneAfterTheOtherWhileTheServerGoesOn) {
  StationOptions options = test_options();
  std::atomic<bool> go_on = false;
  std::atomic<int> at_once = 0;
  options.exports = {{"mesh.ply", "application/octet-stream",
                      [&]() -> Result<std::vector<std::byte>> {
                        EXPECT_EQ(++at_once, 1);
                        while (!go_on) std::this_thread::sleep_for(std::chrono::milliseconds(1));
                        --at_once;
                        return text_bytes("ply\n");
                      }},
                     {"report", "text/html", []() -> Result<std::vector<std::byte>> {
                        return fail(ErrorCode::kNoResult, "report", "there is none before the end");
                      }}};
  const auto station = start_station(std::move(options));
  const std::uint16_t port = port_of(*station);
  std::vector<std::unique_ptr<WebClient>> clients;
  for (int i = 0; i < 12; ++i) {
    clients.push_back(std::make_unique<WebClient>(port));
    clients.back()->send_raw("GET /api/mesh.ply HTTP/1.1\r\nHost: localhost\r\n\r\n");
    // The first one is taken from the line before the others stand in it.
    if (i == 0) {
      ASSERT_TRUE(wait_until([&] { return at_once == 1; }));
    }
    WebClient other(port);
    EXPECT_EQ(other.get("/api/status").status, 200);
  }
  go_on = true;
  int made = 0, refused = 0;
  for (auto& client : clients) {
    const auto response = client->read_response();
    if (response.status == 200) {
      ++made;
      EXPECT_EQ(response.body, "ply\n");
      EXPECT_THAT(response.header, testing::HasSubstr("filename=\"mesh.ply\""));
    } else {
      ++refused;
      EXPECT_EQ(response.status, 503);
    }
  }
  EXPECT_EQ(made, 9);  // one in work, eight that wait
  EXPECT_EQ(refused, 3);
  WebClient client(port);
  const auto report = client.get("/api/report");
  EXPECT_EQ(report.status, 404);
  EXPECT_EQ(report.body, "report: report: there is none before the end\n");
}

TEST(StationApi, AStationEndsWhileAFileIsBeingMade) {
  StationOptions options = test_options();
  std::atomic<bool> started = false;
  options.exports = {{"mesh.ply", "application/octet-stream", [&]() -> Result<std::vector<std::byte>> {
                        started = true;
                        std::this_thread::sleep_for(std::chrono::milliseconds(100));
                        return text_bytes("ply\n");
                      }}};
  auto station = start_station(std::move(options));
  WebClient first(port_of(*station)), second(port_of(*station));
  for (WebClient* client : {&first, &second})
    client->send_raw("GET /api/mesh.ply HTTP/1.1\r\nHost: localhost\r\n\r\n");
  EXPECT_TRUE(wait_until([&] { return started.load(); }));
  station.reset();
  EXPECT_TRUE(second.wait_for_end());
}

}  // namespace
}  // namespace hm
