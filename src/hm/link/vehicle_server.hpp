#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "hm/core/time.hpp"
#include "hm/link/mavlink_peer.hpp"
#include "hm/link/parameter_server.hpp"

namespace hm {

/// What a vehicle answers to a ground station: AUTOPILOT_VERSION on request, parameters, an empty mission,
/// and commands. With it and with telemetry our vehicle appears in QGroundControl.
class VehicleServer {
 public:
  /// A command that comes again within this time with a higher `confirmation` gets the same answer, and is
  /// not done twice: its sender did not hear the first one.
  static constexpr Duration kRepetition{3'000'000'000};
  /// Parameters sent in one step.
  static constexpr int kParametersPerStep = 4;

  /// `do_command` does a command that is ours and returns its MavResult. The peer must outlive the server.
  VehicleServer(MavlinkPeer& peer, std::vector<LinkParameter> parameters,
                std::function<std::uint8_t(const MavCommandLong&, MavlinkAddress from)> do_command);

  /// Answers what is for us; true if this frame was.
  bool receive(const MavlinkFrame& frame, Time now);
  /// Sends parameters that were asked for.
  void step();
  [[nodiscard]] ParameterServer& parameters() { return parameters_; }

 private:
  struct Answered {
    MavlinkAddress from;
    MavCommandLong command;
    MavCommandAck ack;
    Time time;
  };
  [[nodiscard]] bool is_for_us(std::uint8_t system, std::uint8_t component) const;
  void receive_command(const MavCommandLong& command, MavlinkAddress from, Time now);
  [[nodiscard]] bool is_repetition(const MavCommandLong& command, MavlinkAddress from, Time now) const;
  std::uint8_t send_requested(const MavCommandLong& command);

  MavlinkPeer& peer_;
  ParameterServer parameters_;
  std::function<std::uint8_t(const MavCommandLong&, MavlinkAddress)> do_command_;
  std::optional<Answered> answered_;
};

}  // namespace hm
