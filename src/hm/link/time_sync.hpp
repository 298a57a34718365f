#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "hm/core/time.hpp"

namespace hm {

/// Relates another clock to ours from exchanges (TIMESYNC). A Kalman filter of offset and drift takes every
/// exchange with the deviation that its round trip gives it: half of what it exceeds the least of the last
/// 32 by. A difference that no delay explains is a step of a clock: the exchanges before it are forgotten.
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
  [[nodiscard]] double drift() const;
  /// Half the least round trip: the offset is not worse than this.
  [[nodiscard]] std::optional<Duration> uncertainty() const;
  [[nodiscard]] std::uint64_t steps() const { return steps_; }

 private:
  struct Exchange {
    Time local;  ///< middle between sent and received
    Duration offset, round_trip;
  };
  [[nodiscard]] bool is_step(const Exchange& exchange) const;
  void start(const Exchange& exchange);
  void predict(Time local);
  void correct(const Exchange& exchange);

  std::array<Exchange, kWindow> exchanges_{};
  std::size_t count_ = 0, next_ = 0, best_ = 0;
  // The filter: offset beyond start_, drift, and their covariance at at_.
  Time at_;
  Duration start_;
  double offset_s_ = 0, drift_ = 0;
  double var_offset_s2_ = 0, cov_s_ = 0, var_drift_ = 0;
  std::uint64_t steps_ = 0;
};

}  // namespace hm
