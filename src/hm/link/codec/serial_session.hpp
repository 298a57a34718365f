#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "hm/link/codec/serial_frame.hpp"

/// Session of the dissertation's serial protocol, all of it but framing: acknowledgement, handshake, times of
/// sending, and which axes the computer takes from the pilot. Times are microseconds on any clock that does
/// not go back.
namespace hm {

/// Sends one packet after the other that asks for an ACK. The flag counts through all 128 odd values, so that
/// a late ACK is not taken for that of the next packet (the author's are random, which repeat).
class SerialAckSender {
 public:
  static constexpr std::int64_t kTimeoutUs = 1'000'000;  ///< as published
  enum class State : std::uint8_t { kIdle, kWaiting, kAcknowledged, kTimedOut };

  /// `attempts` 1: sent once, as published. More: sent again after each time-out; all packets that ask for an
  /// ACK set something, so that a repetition does no harm.
  explicit SerialAckSender(int attempts = 1) : attempts_(attempts) {}
  /// Takes a packet; it is sent by the next poll(). False while another one is waiting.
  bool send(SerialFrame frame);
  /// The frame to be sent now, if there is one.
  std::optional<SerialFrame> poll(std::int64_t now_us);
  /// A frame of the other end. True if it is the ACK that is waited for.
  bool receive(const SerialFrame& frame);
  [[nodiscard]] State state() const { return state_; }

 private:
  int attempts_, left_ = 0;
  State state_ = State::kIdle;
  SerialFrame frame_;
  std::uint8_t next_flag_ = kSerialAckFlag;
  std::int64_t sent_us_ = 0;
  bool sent_ = false;
};

/// The ACK that an up frame asks for.
[[nodiscard]] std::optional<SerialFrame> acknowledge(const SerialFrame& frame);

/// Opens a connection: 'a', from which the microcontroller measures the baud rate, then DUMMY with ACK, up to
/// five times.
class SerialHandshake {
 public:
  static constexpr int kAttempts = 5;
  static constexpr std::int64_t kPeriodUs = 500'000;
  static constexpr std::uint8_t kAutoBaudByte = 'a';
  enum class State : std::uint8_t { kConnecting, kConnected, kFailed };

  /// Bytes to be sent now; the length may be 0.
  struct Output {
    std::array<std::uint8_t, kSerialMaxFrame + 1> bytes{};
    std::size_t count = 0;
  };
  Output poll(std::int64_t now_us);
  void receive(const SerialFrame& frame);
  [[nodiscard]] State state() const { return state_; }

 private:
  State state_ = State::kConnecting;
  int sent_ = 0;
  std::int64_t last_us_ = 0;
};

/// Streams of the microcontroller, in the order of SerialTransmitConfig.
enum class SerialStream : std::uint8_t { kImu, kRcData, kFlightState, kPose, kStatus, kDebug };

/// Whether a stream is due in a loop of 1 ms: loop % period == phase. Period 0 is never. A phase of a period
/// or more, with which the author's firmware never sends, counts modulo the period.
[[nodiscard]] bool is_due(const SerialTransmitConfig& config, SerialStream stream, std::uint32_t loop);

/// Axes that the computer takes over from the pilot's sticks (bits of the inner loop's control word).
enum SerialAxis : std::uint8_t { kSerialPitch = 1, kSerialRoll = 2, kSerialYaw = 4, kSerialThrust = 8 };
/// The axes that a state claims: while the motors start and stop yaw and thrust (the stick gesture),
/// otherwise all four. In flight, axes of mode 0 (disabled) stay with the pilot. `mode` as in
/// SerialControlConfig.
[[nodiscard]] std::uint8_t claimed_axes(std::uint8_t flight_state, const std::array<std::uint8_t, 4>& mode);

/// STATUS's volts from the inner loop's millivolts: divided once.
[[nodiscard]] constexpr float battery_volts(std::uint16_t millivolts) {
  return static_cast<float>(millivolts) * 1e-3F;
}

}  // namespace hm
