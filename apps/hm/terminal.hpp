#pragma once
#include <chrono>
#include <string>

#include "hm/core/progress.hpp"

/// Progress and messages on standard error: one line that redraws itself on a terminal, a plain line
/// every few seconds elsewhere.
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

  bool interactive_ = false;
  bool drawn_ = false;
  std::string stage_;
  std::size_t stage_begin_done_ = 0;
  Clock::time_point stage_begin_, last_shown_;
};
