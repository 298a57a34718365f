#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <span>
#include <string>
#include <vector>

#include "hm/link/mavlink_peer.hpp"
#include "hm/link/transport/transport.hpp"

namespace hm::link_testing {

/// One end of a way in memory, as datagrams: what is written here is read at `other`.
class PipeTransport : public Transport {
 public:
  PipeTransport* other = nullptr;
  /// Datagrams that are lost from here on.
  int lose = 0;
  std::deque<std::vector<std::uint8_t>> arrived;

  std::size_t read(std::span<std::uint8_t> buffer) override {
    if (arrived.empty()) return 0;
    const auto bytes = arrived.front();
    arrived.pop_front();
    std::copy(bytes.begin(), bytes.end(), buffer.begin());
    return bytes.size();
  }
  bool write(std::span<const std::uint8_t> bytes) override {
    if (!other) return false;
    if (lose > 0)
      --lose;
    else
      other->arrived.emplace_back(bytes.begin(), bytes.end());
    return true;
  }
  bool wait(Duration) override { return !arrived.empty(); }
  [[nodiscard]] bool is_datagram() const override { return true; }
  [[nodiscard]] bool is_open() const override { return other != nullptr; }
  [[nodiscard]] std::string name() const override { return "memory"; }
};

/// Both ends of a way in memory.
struct PipePair {
  PipeTransport vehicle, station;
  PipePair() {
    vehicle.other = &station;
    station.other = &vehicle;
  }
};

/// Identity of a ground station.
inline MavlinkPeerOptions station_options() {
  MavlinkPeerOptions options;
  options.address = {255, 190};
  options.heartbeat.type = kMavTypeGroundStation;
  options.heartbeat.autopilot = kMavAutopilotInvalid;
  return options;
}

}  // namespace hm::link_testing
