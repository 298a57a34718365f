#pragma once
#include <chrono>
#include <mutex>
#include <string>

#include "hm/core/run_context.hpp"

/// Progress and messages on standard error: on a terminal one line that redraws itself and is cut to the
/// width of the terminal (of which it asks the terminal, else COLUMNS), elsewhere a plain line every few
/// seconds. May be used from several threads.
class Terminal {
 public:
  Terminal();
  ~Terminal();
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  void show(const hm::Progress& progress);
  /// A message on a line of its own.
  void line(const std::string& text);

 private:
  using Clock = std::chrono::steady_clock;
  void clear();
  void begin_stage(const hm::Progress& progress, Clock::time_point now);
  [[nodiscard]] std::string progress_text(const hm::Progress& progress, Clock::time_point now) const;
  /// ", 12.3/s, 1:15 left"; nothing while too little is known.
  [[nodiscard]] std::string rate_text(const hm::Progress& progress, Clock::time_point now) const;

  std::mutex mutex_;
  bool interactive_ = false;
  bool drawn_ = false;
  std::string stage_;
  std::size_t stage_begin_done_ = 0;
  Clock::time_point stage_begin_, last_shown_;
};
