#pragma once
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "hm/core/json_value.hpp"
#include "hm/core/time.hpp"
#include "hm/station/station.hpp"

namespace hm {

using PilotId = std::uint64_t;

/// Decides who flies and which orders reach the vehicle (docs/file_formats.md, /pilot): one lease, rising
/// sequences, expiry, and the dead man's rule. No clock and no sockets: times are since any origin, messages
/// wait in next().
///
/// How old a command is: the age of the person's input that it tells, and the longest that it can have been
/// under way, which is the time since the last ping that was answered before it. Thus a line that stalls
/// delivers no old commands, whatever the clock of the pilot shows.
class PilotDesk {
 public:
  /// Without fresh input for so long, a vehicle that is steered has to hold.
  static constexpr Duration kDeadMan{300'000'000};
  static constexpr Duration kPingPeriod{50'000'000};
  /// A pilot that answers no ping for so long is gone.
  static constexpr Duration kGone{3'000'000'000};
  /// Messages that a pilot has not taken; more end the connection.
  static constexpr std::size_t kMaxWaiting = 256;

  /// The handler must outlive the desk.
  explicit PilotDesk(PilotHandler& handler) : handler_(handler) {}

  PilotId open(Duration now);
  /// The connection ended: the lease is free; the vehicle holds if the pilot steered it or sent it somewhere.
  void close(PilotId pilot);
  /// Takes a message. Returns why the connection has to end, if it has to.
  std::optional<std::string> receive(PilotId pilot, std::string_view text, Duration now);
  /// Dead man's rule, pings; call every 5 ms.
  void tick(Duration now);
  /// Answer to an order, with the sequence that PilotOrder had.
  void answer(std::uint64_t sequence, bool accepted, const std::string& reason);
  /// Commands that were answered with a reason why not.
  [[nodiscard]] std::uint64_t refused() const { return refused_; }
  /// Next message to a pilot.
  std::optional<std::string> next(PilotId pilot, Duration now);
  /// Why the connection of a pilot has to end, if it has to: gone, or it does not read.
  [[nodiscard]] std::optional<std::string> reason_to_end(PilotId pilot, Duration now) const;

 private:
  struct Pilot {
    std::optional<std::int64_t> last_sequence;
    std::deque<std::string> waiting;
    std::deque<std::pair<std::int64_t, Duration>> pings;  ///< sent and not answered
    std::int64_t last_ping = 0;
    bool ping_due = false;
    Duration ping_at;
    Duration proven_at;  ///< what comes now was sent after this
    std::optional<Duration> round_trip;
  };
  struct Command {
    std::int64_t sequence = 0;
    std::string kind;
    double age_ms = 0, expires_ms = 0;
    PilotOrder order;
  };
  using Refusal = std::optional<std::string>;

  void take_lease(PilotId pilot, bool force);
  void set_holder(std::optional<PilotId> holder);
  void tell_lease(PilotId id, Pilot& pilot) const;
  void hold(const std::string& reason);
  std::optional<std::string> pong(Pilot& pilot, const JsonValue& message, Duration now);
  std::optional<std::string> command(PilotId id, const JsonValue& message, Duration now);
  [[nodiscard]] Refusal refuse(PilotId id, const Pilot& pilot, const Command& command, Duration now) const;
  void fly(PilotId id, Command command, Duration now);
  static void say(Pilot& pilot, const JsonValue& message);
  static void say_answer(Pilot& pilot, std::int64_t sequence, bool accepted, const std::string& reason);

  /// Steering that ends when the pilot leaves.
  enum class Steering { kNone, kVelocity, kGoTo };

  PilotHandler& handler_;
  PilotId next_pilot_ = 1;
  std::map<PilotId, Pilot> pilots_;
  std::optional<PilotId> holder_;
  Steering steering_ = Steering::kNone;
  Duration input_at_;  ///< of the newest velocity
  std::uint64_t orders_ = 0, refused_ = 0;
  std::map<std::uint64_t, std::pair<PilotId, std::int64_t>> unanswered_;  ///< order -> pilot, its sequence
};

}  // namespace hm
