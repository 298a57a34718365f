#pragma once
#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <memory>
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
  options.voxel_size_m = 0.02;
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

/// Waits up to 5 s; false if it does not come true.
inline bool wait_until(const std::function<bool()>& done) {
  for (int i = 0; i < 1000 && !done(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  return done();
}

}  // namespace hm
