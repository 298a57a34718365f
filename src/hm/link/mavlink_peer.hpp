#pragma once
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "hm/core/time.hpp"
#include "hm/link/codec/mavlink_enums.hpp"
#include "hm/link/codec/mavlink_parser.hpp"
#include "hm/link/command_sender.hpp"
#include "hm/link/time_sync.hpp"
#include "hm/link/transport/transport.hpp"

namespace hm {

struct MavlinkPeerOptions {
  MavlinkAddress address;  ///< ours
  MavHeartbeat heartbeat;  ///< what we say we are
  Duration heartbeat_period{1'000'000'000};
  /// Between questions for the other clock; 0: never asked.
  Duration timesync_period{1'000'000'000};
  /// Another one is gone if it was silent for so long.
  Duration lost_after{3'000'000'000};
  /// Signs what is sent, and then accepts signed frames only.
  std::optional<MavlinkKey> key;
  std::uint8_t signing_link = 0;
};

/// Another vehicle, computer or ground station on the way.
struct MavlinkRemote {
  MavlinkAddress address;
  MavHeartbeat heartbeat;  ///< its last
  Time last_heartbeat;
  std::uint64_t frames = 0;
  std::uint64_t lost_frames = 0;  ///< by gaps in its sequence numbers
  std::uint8_t next_sequence = 0;
};

/// One end of a MAVLink connection over any transport: heartbeats, sequence numbers, who else is there,
/// TIMESYNC both ways, commands with repetition, signing. Times are those of the caller's clock.
class MavlinkPeer {
 public:
  /// The transport must outlive the peer.
  MavlinkPeer(Transport& transport, const MavlinkPeerOptions& options);
  MavlinkPeer(const MavlinkPeer&) = delete;
  MavlinkPeer& operator=(const MavlinkPeer&) = delete;

  /// Reads what has come, sends what is due. Frames of others go to `handle`, after their heartbeats,
  /// TIMESYNC and ACKs were used here. `clock` gives the time at the moment of reading; call often (a late
  /// step makes TIMESYNC worse).
  void step(const std::function<Time()>& clock, const std::function<void(const MavlinkFrame&)>& handle);

  /// False if the transport did not take it.
  template <class Message>
  bool send(const Message& message) {
    return send_frame(make_mavlink_frame(message, options_.address, sequence_));
  }
  /// STATUSTEXT; a longer text goes in numbered parts of 50 letters, 255 parts at most.
  void send_text(std::uint8_t severity, std::string_view text);

  /// Changes mode or state in the next heartbeats.
  [[nodiscard]] MavHeartbeat& heartbeat() { return options_.heartbeat; }
  [[nodiscard]] CommandSender& commands() { return commands_; }
  /// Sets the clock of signatures: microseconds since 1970.
  void set_signing_time(std::uint64_t unix_us);

  /// The autopilot whose message came first, of those that are not gone, nullptr if none.
  [[nodiscard]] const MavlinkRemote* autopilot(Time now) const;
  /// Everyone who sent a heartbeat and is not gone.
  [[nodiscard]] std::vector<MavlinkRemote> remotes(Time now) const;
  /// Clock of the autopilot, or of whoever answered, against ours.
  [[nodiscard]] const TimeSync& time_sync() const { return time_sync_; }
  [[nodiscard]] const MavlinkParserCounts& counts() const { return parser_.counts(); }
  [[nodiscard]] MavlinkAddress address() const { return options_.address; }
  /// Frames that the transport did not take.
  [[nodiscard]] std::uint64_t unsent() const { return unsent_; }

 private:
  bool send_frame(const MavlinkFrame& frame);
  void send_due(Time now);
  void receive(const MavlinkFrame& frame, Time now);
  void receive_timesync(const MavlinkFrame& frame, const MavTimesync& message, Time now);

  Transport& transport_;
  MavlinkPeerOptions options_;
  std::optional<MavlinkSigner> signer_;
  std::optional<MavlinkVerifier> verifier_;
  MavlinkParser parser_;
  CommandSender commands_;
  TimeSync time_sync_;
  std::map<std::pair<std::uint8_t, std::uint8_t>, MavlinkRemote> remotes_;
  std::vector<MavlinkAddress> order_;  ///< in the order of their first messages
  std::optional<MavlinkAddress> clock_of_;
  std::optional<Time> last_heartbeat_, last_timesync_;
  std::uint8_t sequence_ = 0;
  std::uint16_t text_id_ = 0;
  std::uint64_t unsent_ = 0;
};

}  // namespace hm
