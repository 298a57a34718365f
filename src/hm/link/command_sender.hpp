#pragma once
#include <cstdint>
#include <optional>

#include "hm/core/time.hpp"
#include "hm/link/codec/mavlink_commands.hpp"
#include "hm/link/codec/mavlink_frame.hpp"

namespace hm {

/// Sends one COMMAND_LONG after the other until it is acknowledged: `confirmation` counts the repetitions,
/// and an answer "in progress" is waited for longer (mavlink.io, "Command Protocol").
class CommandSender {
 public:
  static constexpr Duration kTimeout{500'000'000}, kProgressTimeout{5'000'000'000};
  static constexpr int kAttempts = 5;
  enum class State { kIdle, kWaiting, kAnswered, kTimedOut };

  /// False while another command waits.
  bool send(const MavCommandLong& command);
  /// Gives up what waits, for something more urgent.
  void cancel() { state_ = State::kIdle; }
  /// Next command to send, if one is due.
  std::optional<MavCommandLong> poll(Time now);
  /// An answer of `from` to `us`; true if it ends or prolongs the command that waits. Answers to others, and
  /// of others than the command's target (target 0: of anyone), change nothing.
  bool receive(const MavCommandAck& ack, MavlinkAddress from, MavlinkAddress us, Time now);
  [[nodiscard]] State state() const { return state_; }
  /// The answer (MavResult) once the state is kAnswered.
  [[nodiscard]] std::uint8_t result() const { return result_; }

 private:
  State state_ = State::kIdle;
  MavCommandLong command_;
  int sent_ = 0;
  Time due_;
  bool in_progress_ = false;
  std::uint8_t result_ = 0;
};

}  // namespace hm
