#pragma once
#include <condition_variable>
#include <mutex>
#include <optional>
#include <stop_token>

#include "hm/core/json_value.hpp"
#include "hm/core/time.hpp"
#include "hm/station/station.hpp"

namespace hm {

/// Subject of a replay: moments of a recording, each of which continues the one before.
class ReplaySubject {
 public:
  virtual ~ReplaySubject() = default;
  [[nodiscard]] virtual std::size_t count() const = 0;
  [[nodiscard]] virtual Time stamp(std::size_t moment) const = 0;
  /// Forgets everything: the next moment is the first.
  virtual void restart() = 0;
  /// Processes the next moment and shows it.
  virtual void show(std::size_t moment) = 0;
  /// The replay rests here: what was held back is shown.
  virtual void settle() = 0;
};

/// Shows a recording at its own pace, or as viewers steer it: pause, speed, a place to go to. To go back it
/// begins anew and hurries to the place. request() may be called from any thread.
class Replay {
 public:
  /// Highest and lowest speed, times the recording's own.
  static constexpr double kLowestSpeed = 0.05, kHighestSpeed = 100;

  explicit Replay(ReplaySubject& subject) : subject_(subject) {}
  void request(const ReplayRequest& request);

  /// Shows the next moment when it is due; waits at most `most_s` for it. False: nothing was shown (paused,
  /// at the end, or not due yet).
  bool step(double most_s);
  [[nodiscard]] bool at_end() const;
  /// {time_s, begin_s, end_s, speed, paused}
  [[nodiscard]] JsonValue state() const;

 private:
  void take_request();
  [[nodiscard]] double time_s(std::size_t moment) const;

  ReplaySubject& subject_;
  mutable std::mutex mutex_;  // guards the next one
  std::condition_variable requested_;
  ReplayRequest request_;
  bool is_requested_ = false;
  // Of the replay's thread.
  bool paused_ = false;
  double speed_ = 1;
  std::size_t next_ = 0, hurry_to_ = 0;
  bool rests_ = true;
  double ahead_s_ = 0;  ///< of the wall clock, until the next moment is due
};

}  // namespace hm
