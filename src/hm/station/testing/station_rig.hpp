#pragma once
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "hm/station/live_frames.hpp"
#include "hm/station/station.hpp"
#include "hm/station/testing/web_client.hpp"

namespace hm {

/// Options of a station on any free port of loopback.
inline StationOptions test_options() {
  StationOptions options;
  options.port_given = true;
  options.source = JsonValue::object({{"verb", "demo"}, {"name", "test"}});
  options.program_version = "1.2.3";
  return options;
}

inline std::unique_ptr<Station> start_station(StationOptions options = test_options()) {
  auto station = Station::start(std::move(options));
  EXPECT_TRUE(station) << to_string(station.error());
  return std::move(*station);
}

inline std::uint16_t port_of(const Station& station) {
  const std::string url = station.url();
  return static_cast<std::uint16_t>(std::atoi(url.c_str() + url.find(':', 6) + 1));
}

/// Reads binary messages until one of a kind comes.
inline LiveMessage read_until(WebClient& client, LiveKind kind) {
  while (const auto message = client.read_message()) {
    EXPECT_EQ(message->opcode, 2) << message->reason();
    if (message->opcode != 2) return {};
    auto decoded = decode_live_message(message->bytes());
    EXPECT_TRUE(decoded) << to_string(decoded.error());
    if (!decoded || decoded->kind == kind) return decoded ? std::move(*decoded) : LiveMessage{};
  }
  ADD_FAILURE() << "the connection ended";
  return {};
}

/// A viewer that says hello and acknowledges as the format asks for: one ack for all frames of 20 ms.
class LiveViewer {
 public:
  /// `known`: pages of `session` as in the viewer's hello.
  explicit LiveViewer(std::uint16_t port, const std::string& session = "", const std::string& known = "",
                      int receive_buffer_bytes = 0)
      : client_(port, 20, receive_buffer_bytes) {
    EXPECT_EQ(client_.upgrade("/live").status, 101);
    client_.send_text(
        fmt::format(R"({{"type":"hello","protocol":1,"session":"{}","pages":[{}]}})", session, known));
  }
  /// The next frame; nothing when the connection ended, or when nothing came for 20 s.
  std::optional<LiveMessage> next() {
    acknowledge();
    const auto message = client_.read_message();
    if (!message) return std::nullopt;
    EXPECT_EQ(message->opcode, 2) << message->reason();
    if (message->opcode != 2) return std::nullopt;
    auto decoded = decode_live_message(message->bytes());
    EXPECT_TRUE(decoded) << to_string(decoded.error());
    if (!decoded) return std::nullopt;
    newest_ = decoded->sequence;
    bytes_ += message->data.size();
    return std::move(*decoded);
  }
  [[nodiscard]] std::size_t bytes() const { return bytes_; }

 private:
  using Clock = std::chrono::steady_clock;
  void acknowledge() {
    if (newest_ == acknowledged_) return;
    const double left_s = 0.02 - std::chrono::duration<double>(Clock::now() - acknowledged_at_).count();
    if (left_s > 0 && client_.has_data(left_s)) return;
    client_.send_text(fmt::format(R"({{"type":"ack","sequence":{}}})", newest_));
    acknowledged_ = newest_;
    acknowledged_at_ = Clock::now();
  }

  WebClient client_;
  std::uint32_t newest_ = 0, acknowledged_ = 0;
  Clock::time_point acknowledged_at_;
  std::size_t bytes_ = 0;
};

/// Waits up to 20 s; false if it does not come true.
inline bool wait_until(const std::function<bool()>& done) {
  for (int i = 0; i < 4000; ++i) {
    if (done()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return false;
}

}  // namespace hm
