#include "hm/link/codec/serial_session.hpp"

namespace hm {
namespace {

constexpr std::uint8_t kStateEngaging = 1, kStateDisengaging = 2, kStateLanding = 4, kStateFlying = 5;

}  // namespace

bool SerialAckSender::send(SerialFrame frame) {
  if (state_ == State::kWaiting) return false;
  frame.flag = next_flag_;
  next_flag_ = static_cast<std::uint8_t>(next_flag_ + 2);
  frame_ = frame;
  left_ = attempts_;
  sent_ = false;
  state_ = State::kWaiting;
  return true;
}

std::optional<SerialFrame> SerialAckSender::poll(std::int64_t now_us) {
  if (state_ != State::kWaiting || (sent_ && now_us - sent_us_ < kTimeoutUs)) return std::nullopt;
  if (left_ == 0) {
    state_ = State::kTimedOut;
    return std::nullopt;
  }
  --left_;
  sent_ = true;
  sent_us_ = now_us;
  return frame_;
}

bool SerialAckSender::receive(const SerialFrame& frame) {
  const auto ack = read_serial_packet<SerialAck>(frame);
  if (state_ != State::kWaiting || !sent_ || !ack || ack->flag != frame_.flag) return false;
  state_ = State::kAcknowledged;
  return true;
}

std::optional<SerialFrame> acknowledge(const SerialFrame& frame) {
  if (frame.direction != SerialDirection::kUp || (frame.flag & kSerialAckFlag) == 0) return std::nullopt;
  return make_serial_frame(SerialAck{frame.flag}, SerialDirection::kDown);
}

SerialHandshake::Output SerialHandshake::poll(std::int64_t now_us) {
  Output output;
  if (state_ != State::kConnecting || (sent_ > 0 && now_us - last_us_ < kPeriodUs)) return output;
  if (sent_ == kAttempts) {
    state_ = State::kFailed;
    return output;
  }
  if (sent_ == 0) output.bytes[output.count++] = kAutoBaudByte;
  SerialBytes bytes{};
  const std::size_t count =
      write_serial_frame(make_serial_frame(SerialDummy{}, SerialDirection::kUp, kSerialAckFlag), bytes);
  for (std::size_t i = 0; i < count; ++i) output.bytes[output.count++] = bytes[i];
  ++sent_;
  last_us_ = now_us;
  return output;
}

void SerialHandshake::receive(const SerialFrame& frame) {
  const auto ack = read_serial_packet<SerialAck>(frame);
  if (state_ == State::kConnecting && sent_ > 0 && ack && ack->flag == kSerialAckFlag)
    state_ = State::kConnected;
}

bool is_due(const SerialTransmitConfig& config, SerialStream stream, std::uint32_t loop) {
  const auto i = static_cast<std::size_t>(stream);
  if (i >= config.period_ms.size() || config.period_ms[i] == 0) return false;
  const std::uint32_t period = config.period_ms[i];
  return loop % period == config.phase_ms[i] % period;
}

std::uint8_t claimed_axes(std::uint8_t flight_state, const std::array<std::uint8_t, 4>& mode) {
  if (flight_state == kStateEngaging || flight_state == kStateDisengaging) return kSerialYaw | kSerialThrust;
  constexpr std::array<std::uint8_t, 4> kBits{kSerialRoll, kSerialPitch, kSerialYaw, kSerialThrust};
  std::uint8_t axes = 0;
  for (std::size_t i = 0; i < kBits.size(); ++i)
    if ((flight_state != kStateLanding && flight_state != kStateFlying) || mode[i] != 0)
      axes = static_cast<std::uint8_t>(axes | kBits[i]);
  return axes;
}

}  // namespace hm
