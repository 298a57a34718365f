#include "hm/link/command_sender.hpp"

#include "hm/link/codec/mavlink_enums.hpp"

namespace hm {

bool CommandSender::send(const MavCommandLong& command) {
  if (state_ == State::kWaiting) return false;
  command_ = command;
  sent_ = 0;
  in_progress_ = false;
  state_ = State::kWaiting;
  return true;
}

std::optional<MavCommandLong> CommandSender::poll(Time now) {
  if (state_ != State::kWaiting || (sent_ > 0 && now < due_)) return std::nullopt;
  if (sent_ == kAttempts || in_progress_) {
    state_ = State::kTimedOut;
    return std::nullopt;
  }
  command_.confirmation = static_cast<std::uint8_t>(sent_++);
  due_ = now + kTimeout;
  return command_;
}

bool CommandSender::receive(const MavCommandAck& ack, MavlinkAddress from, MavlinkAddress us, Time now) {
  if (state_ != State::kWaiting || sent_ == 0 || ack.command != command_.command) return false;
  if (command_.target_system != 0 && from.system != command_.target_system) return false;
  if (command_.target_component != 0 && from.component != command_.target_component) return false;
  // Targets of 0: an older receiver, which does not say whom it answers.
  if (ack.target_system != 0 && ack.target_system != us.system) return false;
  if (ack.target_component != 0 && ack.target_component != us.component) return false;
  if (ack.result == kMavInProgress) {
    in_progress_ = true;
    due_ = now + kProgressTimeout;
    return true;
  }
  result_ = ack.result;
  state_ = State::kAnswered;
  return true;
}

}  // namespace hm
