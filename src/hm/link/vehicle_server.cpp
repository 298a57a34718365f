#include "hm/link/vehicle_server.hpp"

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

}  // namespace

VehicleServer::VehicleServer(MavlinkPeer& peer, std::vector<LinkParameter> parameters,
                             std::function<std::uint8_t(const MavCommandLong&, MavlinkAddress)> do_command)
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
  return answer(read_mavlink_message<MavCommandLong>(frame),
                [&](const MavCommandLong& command) { receive_command(command, frame.from, now); });
}

bool VehicleServer::is_repetition(const MavCommandLong& command, MavlinkAddress from, Time now) const {
  return answered_ && command.confirmation > answered_->command.confirmation && answered_->from == from &&
         now - answered_->time < kRepetition &&
         command_payload(command) == command_payload(answered_->command);
}

void VehicleServer::receive_command(const MavCommandLong& command, MavlinkAddress from, Time now) {
  if (!is_repetition(command, from, now)) {
    MavCommandAck ack;
    ack.command = command.command;
    ack.target_system = from.system;
    ack.target_component = from.component;
    ack.result =
        command.command == kMavCommandRequestMessage ? send_requested(command) : do_command_(command, from);
    answered_ = {from, command, ack, now};
  }
  peer_.send(answered_->ack);
}

std::uint8_t VehicleServer::send_requested(const MavCommandLong& command) {
  if (command.param1 != static_cast<float>(MavAutopilotVersion::kId)) return kMavUnsupported;
  MavAutopilotVersion version;
  version.capabilities = kMavCanParamFloat | kMavCanSetAttitude | kMavCanSetPosition | kMavCanMavlink2;
  peer_.send(version);
  return kMavAccepted;
}

void VehicleServer::step() {
  for (int i = 0; i < kParametersPerStep; ++i) {
    const auto value = parameters_.next();
    if (!value) return;
    peer_.send(*value);
  }
}

}  // namespace hm
