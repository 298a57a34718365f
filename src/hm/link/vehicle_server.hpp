#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "hm/core/time.hpp"
#include "hm/link/mavlink_peer.hpp"
#include "hm/link/parameter_server.hpp"

namespace hm {

/// Where a command came from.
struct CommandOrigin {
  MavlinkAddress from;
  /// MavFrame of a COMMAND_INT: that of its position, which is then in param5 to param7, in m if the frame is
  /// local.
  std::optional<std::uint8_t> frame;
};

/// Answers of a vehicle to a ground station: AUTOPILOT_VERSION on request, parameters, an empty mission,
/// and commands (COMMAND_LONG, COMMAND_INT). With it and with telemetry our vehicle appears in
/// QGroundControl.
class VehicleServer {
 public:
  /// MavResult of a command that is ours; kMavInProgress: finish() will tell.
  using DoCommand = std::function<std::uint8_t(const MavCommandLong&, const CommandOrigin&)>;
  /// A command that comes again within this time with a higher `confirmation` gets the same answer, and is
  /// not done twice: its sender did not receive the first one.
  static constexpr Duration kRepetition{3'000'000'000};
  /// Parameters sent in one step.
  static constexpr int kParametersPerStep = 4;
  /// A command that is not finished after the first time is acknowledged as in progress, after the second as
  /// failed. A sender that receives "in progress" repeats no more, so that most commands had better end
  /// first.
  static constexpr Duration kProgressAfter{250'000'000}, kGiveUpAfter{2'000'000'000};
  /// Commands in progress; further ones are rejected for the time being.
  static constexpr std::size_t kMostBegun = 8;

  /// The peer must outlive the server.
  VehicleServer(MavlinkPeer& peer, std::vector<LinkParameter> parameters, DoCommand do_command);

  /// Answers what is for us; true if this frame was.
  bool receive(const MavlinkFrame& frame, Time now);
  /// Acknowledges a command in progress with its result; nothing if it was given up meanwhile.
  void finish(std::uint16_t command, MavlinkAddress from, std::uint8_t result);
  /// Sends parameters that were asked for, and what is due of commands in progress.
  void step(Time now);
  [[nodiscard]] ParameterServer& parameters() { return parameters_; }

 private:
  struct Answered {
    MavlinkAddress from;
    MavCommandLong command;
    MavCommandAck ack;
    Time time;
  };
  /// A command in progress; its sender is the target of the acknowledgement.
  struct Begun {
    MavCommandAck ack;
    Time since;
    bool is_told = false;
  };
  [[nodiscard]] bool is_for_us(std::uint8_t system, std::uint8_t component) const;
  void receive_command(const MavCommandLong& command, const CommandOrigin& origin, Time now);
  [[nodiscard]] std::uint8_t begin(const MavCommandLong& command, const CommandOrigin& origin);
  [[nodiscard]] std::vector<Begun>::iterator find_begun(std::uint16_t command, MavlinkAddress from);
  [[nodiscard]] bool is_repetition(const MavCommandLong& command, MavlinkAddress from, Time now) const;
  std::uint8_t send_requested(const MavCommandLong& command);

  MavlinkPeer& peer_;
  ParameterServer parameters_;
  DoCommand do_command_;
  std::optional<Answered> answered_;
  std::vector<Begun> begun_;
};

}  // namespace hm
