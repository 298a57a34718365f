#pragma once
#include <cstddef>
#include <functional>
#include <stop_token>
#include <string>

#include "hm/core/result.hpp"

namespace hm {

enum class LogLevel { kInfo, kWarning };

/// Where a pipeline sends its messages. The library itself never prints: a front end passes a sink, and
/// an empty sink discards.
using LogSink = std::function<void(LogLevel, const std::string& message)>;

/// How far a long run is. `total` is 0 while it is not known; `details` are words for the end of a
/// progress line ("1,234 volumes, 96 MB").
struct Progress {
  std::string stage;
  std::size_t done = 0;
  std::size_t total = 0;
  std::string details;
};

/// Called often by long runs, from the thread that runs them; an empty sink discards.
using ProgressSink = std::function<void(const Progress&)>;

/// What a long run is given besides its task.
struct RunContext {
  int threads = 1;
  std::string program_version;  ///< named in what is written
  ProgressSink progress;
  LogSink log;
  std::stop_token stop;  ///< asks the run to end early; each says what it then leaves
};

/// The same result; an error of writing becomes a failure of the run (kInternal), as it is none of the input.
/// What the user asked for and cannot have (kUsage), or took back (kCancelled), stays that.
template <class T>
Result<T> as_run_failure(Result<T> result) {
  if (!result && result.error().code != ErrorCode::kUsage && result.error().code != ErrorCode::kCancelled)
    result.error().code = ErrorCode::kInternal;
  return result;
}

}  // namespace hm
