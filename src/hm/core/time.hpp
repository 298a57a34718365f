#pragma once
#include <cmath>
#include <compare>
#include <cstdint>
#include <optional>

namespace hm {

/// Time span in integer nanoseconds.
struct Duration {
  std::int64_t ns = 0;
  static constexpr Duration from_seconds(double seconds) {
    return {static_cast<std::int64_t>(seconds * 1e9 + (seconds < 0 ? -0.5 : 0.5))};
  }
  [[nodiscard]] constexpr double seconds() const { return static_cast<double>(ns) * 1e-9; }
  auto operator<=>(const Duration&) const = default;
};

/// Timestamp on the clock of the recording, in integer nanoseconds. Always taken from the data, never from
/// the wall clock.
struct Time {
  std::int64_t ns = 0;
  static constexpr Time from_seconds(double seconds) { return {Duration::from_seconds(seconds).ns}; }
  [[nodiscard]] constexpr double seconds() const { return static_cast<double>(ns) * 1e-9; }
  auto operator<=>(const Time&) const = default;
};

constexpr Duration operator-(Time a, Time b) { return {a.ns - b.ns}; }
constexpr Time operator+(Time t, Duration d) { return {t.ns + d.ns}; }
constexpr Time operator-(Time t, Duration d) { return {t.ns - d.ns}; }
constexpr Duration operator+(Duration a, Duration b) { return {a.ns + b.ns}; }

/// Whether a periodic task is due: at first, from a period after the last time on, and when the clock ran
/// backwards. If so, `last` becomes `now`.
constexpr bool is_due(std::optional<Time>& last, Duration period, Time now) {
  if (last && now >= *last && now - *last < period) return false;
  last = now;
  return true;
}

}  // namespace hm
