#include "hm/link/vehicle_server.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace hm {
namespace {

std::array<std::uint8_t, kMavlinkMaxPayload> command_payload(MavCommandLong command) {
  command.confirmation = 0;
  std::array<std::uint8_t, kMavlinkMaxPayload> payload{};
  store_mavlink_payload(command, payload);
  return payload;
}

/// The same with its position in floating point, as far as that is one of a local frame.
MavCommandLong without_frame(const MavCommandInt& command) {
  constexpr double kLocal_m = 1e-4;
  MavCommandLong plain;
  plain.command = command.command;
  plain.param1 = command.param1;
  plain.param2 = command.param2;
  plain.param3 = command.param3;
  plain.param4 = command.param4;
  plain.param5 = static_cast<float>(kLocal_m * command.x);
  plain.param6 = static_cast<float>(kLocal_m * command.y);
  plain.param7 = command.z;
  return plain;
}

}  // namespace

VehicleServer::VehicleServer(MavlinkPeer& peer, std::vector<LinkParameter> parameters, DoCommand do_command)
    : peer_(peer), parameters_(std::move(parameters)), do_command_(std::move(do_command)) {}

bool VehicleServer::is_for_us(std::uint8_t system, std::uint8_t component) const {
  const MavlinkAddress us = peer_.address();
  return (system == 0 || system == us.system) && (component == 0 || component == us.component);
}

bool VehicleServer::receive(const MavlinkFrame& frame, Time now) {
  const auto answer = [&]<class Message>(const std::optional<Message>& message, auto&& action) {
    if (!message || !is_for_us(message->target_system, message->target_component)) return false;
    action(*message);
    return true;
  };
  const auto to_parameters = [&](const auto& message) { parameters_.receive(message); };
  if (answer(read_mavlink_message<MavParamRequestList>(frame), to_parameters)) return true;
  if (answer(read_mavlink_message<MavParamRequestRead>(frame), to_parameters)) return true;
  if (answer(read_mavlink_message<MavParamSet>(frame), to_parameters)) return true;
  if (answer(read_mavlink_message<MavMissionRequestList>(frame), [&](const MavMissionRequestList& request) {
        MavMissionCount none;
        none.target_system = frame.from.system;
        none.target_component = frame.from.component;
        none.mission_type = request.mission_type;
        peer_.send(none);
      }))
    return true;
  if (answer(read_mavlink_message<MavCommandInt>(frame), [&](const MavCommandInt& command) {
        receive_command(without_frame(command), {frame.from, command.frame}, now);
      }))
    return true;
  return answer(read_mavlink_message<MavCommandLong>(frame), [&](const MavCommandLong& command) {
    receive_command(command, {frame.from, {}}, now);
  });
}

bool VehicleServer::is_repetition(const MavCommandLong& command, MavlinkAddress from, Time now) const {
  return answered_ && command.confirmation > answered_->command.confirmation && answered_->from == from &&
         now - answered_->time < kRepetition &&
         command_payload(command) == command_payload(answered_->command);
}

std::vector<VehicleServer::Begun>::iterator VehicleServer::find_begun(std::uint16_t command,
                                                                      MavlinkAddress from) {
  return std::ranges::find_if(begun_, [&](const Begun& begun) {
    return begun.ack.command == command && begun.ack.target_system == from.system &&
           begun.ack.target_component == from.component;
  });
}

std::uint8_t VehicleServer::begin(const MavCommandLong& command, const CommandOrigin& origin) {
  if (command.command == kMavCommandRequestMessage) return send_requested(command);
  const bool runs = find_begun(command.command, origin.from) != begun_.end();
  if (runs || begun_.size() >= kMostBegun) return kMavTemporarilyRejected;
  return do_command_(command, origin);
}

void VehicleServer::receive_command(const MavCommandLong& command, const CommandOrigin& origin, Time now) {
  if (is_repetition(command, origin.from, now)) {
    peer_.send(answered_->ack);
    return;
  }
  MavCommandAck ack;
  ack.command = command.command;
  ack.target_system = origin.from.system;
  ack.target_component = origin.from.component;
  ack.result = begin(command, origin);
  answered_ = {origin.from, command, ack, now};
  if (ack.result == kMavInProgress)
    begun_.push_back({ack, now});
  else
    peer_.send(ack);
}

void VehicleServer::finish(std::uint16_t command, MavlinkAddress from, std::uint8_t result) {
  const auto found = find_begun(command, from);
  if (found == begun_.end()) return;
  MavCommandAck ack = found->ack;
  begun_.erase(found);
  ack.result = result;
  peer_.send(ack);
  // What repeats the command is told the same.
  if (answered_ && answered_->from == from && answered_->ack.command == command) answered_->ack = ack;
}

std::uint8_t VehicleServer::send_requested(const MavCommandLong& command) {
  if (command.param1 != static_cast<float>(MavAutopilotVersion::kId)) return kMavUnsupported;
  MavAutopilotVersion version;
  version.capabilities = kMavCanParamFloat | kMavCanCommandInt | kMavCanSetPosition | kMavCanMavlink2;
  peer_.send(version);
  return kMavAccepted;
}

void VehicleServer::step(Time now) {
  for (Begun& begun : begun_) {
    if (begun.is_told || now - begun.since < kProgressAfter) continue;
    begun.is_told = true;
    peer_.send(begun.ack);
  }
  // In order, so the oldest is the first that is given up.
  while (!begun_.empty() && now - begun_.front().since >= kGiveUpAfter) {
    peer_.send_text(kMavWarning, "the vehicle does not answer a command");
    const MavCommandAck& ack = begun_.front().ack;
    finish(ack.command, {ack.target_system, ack.target_component}, kMavFailed);
  }
  for (int i = 0; i < kParametersPerStep; ++i) {
    const auto value = parameters_.next();
    if (!value) return;
    peer_.send(*value);
  }
}

}  // namespace hm
