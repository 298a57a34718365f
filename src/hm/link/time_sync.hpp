#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "hm/core/time.hpp"

namespace hm {

/// Relates another clock to ours from exchanges (TIMESYNC): offset from the exchange with the least round
/// trip of the last 32, drift by a weighted line through them. A difference that no delay explains is a step
/// of a clock: the exchanges before it are forgotten.
class TimeSync {
 public:
  static constexpr std::size_t kWindow = 32;
  /// Round trips above this say nothing: the answer belongs to a former question.
  static constexpr Duration kMaxRoundTrip{1'000'000'000};
  /// Clocks differ by less (quartz: 50 ppm each, and warm); a larger slope is noise.
  static constexpr double kMaxDrift = 200e-6;

  enum class Update { kUsed, kRejected, kClockStep };
  /// An exchange: we sent at `sent` and received at `received` on our clock, the other one answered at
  /// `remote` on its.
  Update add(Time sent, Time remote, Time received);

  /// Remote minus local time at a local time; nothing before the first exchange.
  [[nodiscard]] std::optional<Duration> offset_at(Time local) const;
  /// Local time of a remote stamp, and back.
  [[nodiscard]] std::optional<Time> to_local(Time remote) const;
  [[nodiscard]] std::optional<Time> to_remote(Time local) const;
  /// Seconds that the remote clock gains in a second.
  [[nodiscard]] double drift() const { return drift_; }
  /// Half the least round trip: the offset is not worse than this.
  [[nodiscard]] std::optional<Duration> uncertainty() const;
  [[nodiscard]] std::uint64_t steps() const { return steps_; }

 private:
  struct Exchange {
    Time local;  ///< middle between sent and received
    Duration offset, round_trip;
  };
  [[nodiscard]] bool is_step(const Exchange& exchange) const;
  void fit();

  std::array<Exchange, kWindow> exchanges_{};
  std::size_t count_ = 0, next_ = 0, best_ = 0;
  double drift_ = 0;
  std::uint64_t steps_ = 0;
};

}  // namespace hm
