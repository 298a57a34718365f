#pragma once
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "hm/core/params.hpp"
#include "hm/core/rng.hpp"
#include "hm/core/time.hpp"

namespace hm {

/// Properties of a link that carries the messages of one stream.
struct StreamLinkParams {
  double latency_s = 0;        ///< from the last byte sent to its arrival
  double jitter_s = 0;         ///< added to it, uniform in [0, jitter]
  double bytes_per_s = 0;      ///< bandwidth; 0: unlimited
  double bit_error_ratio = 0;  ///< probability of a bit to arrive inverted
  double max_queue_s = 0.5;    ///< a message that would wait longer for the bandwidth is dropped

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"latency_s", {0, 10}, "latency of the link"}, self.latency_s);
  }
};

/// Links of the dissertation's vehicle (2.2): laser scans 20 ms after their sweep, camera frames, commands to
/// the motors, and the serial line between the computers with 460,800 baud, 8N1.
inline constexpr StreamLinkParams kLaserLink{0.020, 0.004};
inline constexpr StreamLinkParams kCameraLink{0.035, 0.005};
inline constexpr StreamLinkParams kCommandLink{0.002, 0.0005};
inline constexpr StreamLinkParams kSerialLink{0.001, 0.0005, 46080};

/// Messages of a link, counted.
struct StreamLinkCounts {
  std::uint64_t sent = 0;
  std::uint64_t cut = 0;        ///< lost because the link was cut when they were sent
  std::uint64_t overflown = 0;  ///< dropped because the queue was full
  std::uint64_t damaged = 0;    ///< with at least one inverted bit
};

/// Times and damage of a link, whatever its messages are. Messages arrive in the order in which they were
/// sent. A cut loses messages sent meanwhile; those on their way arrive.
class LinkChannel {
 public:
  /// Bit error ratio of the fault `link_noise`.
  static constexpr double kFaultBitErrorRatio = 1e-3;

  LinkChannel(const StreamLinkParams& params, std::uint64_t seed);

  void set_faults(bool is_cut, bool is_noisy);
  /// Time of arrival of a message sent at `now`, which must not be before that of the last one; nothing when
  /// it is lost.
  std::optional<Time> send(Time now, std::size_t bytes);
  /// Inverts bits of a message at the link's bit error ratio; returns their number.
  std::size_t damage(std::span<std::uint8_t> bytes);
  /// Whether a message of this length is damaged, for messages that are not bytes.
  bool is_damaged(std::size_t bytes);
  [[nodiscard]] const StreamLinkCounts& counts() const { return counts_; }

 private:
  [[nodiscard]] double bit_error_ratio() const;
  /// Number of sound bits before the next inverted one (geometric distribution).
  double sound_bits();

  StreamLinkParams params_;
  Rng rng_, error_rng_;
  bool is_cut_ = false, is_noisy_ = false;
  double busy_until_s_ = 0;
  Time last_arrival_{INT64_MIN};
  StreamLinkCounts counts_;
};

/// Link that carries messages of type T with latency, jitter, bandwidth, bit errors and cuts. Messages of
/// type std::vector<std::uint8_t> arrive with their damaged bits; damaged messages of other types are lost,
/// as their checksum would be wrong.
template <class T>
class StreamLink {
 public:
  /// Message with its time of arrival.
  struct Arrival {
    Time at;
    T message;
  };

  StreamLink(const StreamLinkParams& params, std::uint64_t seed) : channel_(params, seed) {}

  /// Sends a message; `bytes` is its length on the wire (ignored when T is a vector of bytes).
  void send(Time now, T message, std::size_t bytes = 0) {
    bool is_lost = false;
    if constexpr (kIsBytes) {
      bytes = message.size();
      channel_.damage(message);
    } else {
      is_lost = channel_.is_damaged(bytes);
    }
    const std::optional<Time> at = channel_.send(now, bytes);
    if (at && !is_lost) queue_.push_back({*at, std::move(message)});
  }
  /// Next message that has arrived by `now`, in the order of sending; nothing when there is none.
  std::optional<Arrival> receive(Time now) {
    if (queue_.empty() || queue_.front().at > now) return std::nullopt;
    Arrival first = std::move(queue_.front());
    queue_.pop_front();
    return first;
  }
  void set_faults(bool is_cut, bool is_noisy) { channel_.set_faults(is_cut, is_noisy); }
  [[nodiscard]] const StreamLinkCounts& counts() const { return channel_.counts(); }

 private:
  static constexpr bool kIsBytes = std::is_same_v<T, std::vector<std::uint8_t>>;
  LinkChannel channel_;
  std::deque<Arrival> queue_;
};

}  // namespace hm
