#pragma once
#include <cstddef>
#include <functional>
#include <stop_token>
#include <string>

#include "hm/core/result.hpp"
#include "hm/core/thread_priority.hpp"

namespace hm {

class LiveView;  // pipeline/live/live_view.hpp

enum class LogLevel { kInfo, kWarning };

/// Receiver of log messages. The library itself never prints: a front end passes a sink; an empty sink
/// discards.
using LogSink = std::function<void(LogLevel, const std::string& message)>;

/// Progress of a long run. `total` is 0 while unknown; `details` is appended to a progress line ("1,234
/// volumes, 96 MB").
struct Progress {
  std::string stage;
  std::size_t done = 0;
  std::size_t total = 0;
  std::string details;
};

/// Receiver of progress, called often and from the thread of the run; an empty sink discards.
using ProgressSink = std::function<void(const Progress&)>;

/// Environment of a long run: threads, sinks, stop request.
struct RunContext {
  int threads = 1;
  std::string program_version;  ///< recorded in output files
  ProgressSink progress;
  LogSink log;
  std::stop_token stop = {};  ///< requests an early end; each run documents what it leaves
  LiveView* view = nullptr;   ///< is shown the run while it goes on; null: nobody
  /// Priority of threads whose work can wait (closing loops, rebuilding the map): low where frames come at
  /// the pace of a sensor.
  ThreadPriority background = ThreadPriority::kNormal;
};

/// Converts an error of writing into a failure of the run (kInternal), since the input did not cause it.
/// kUsage and kCancelled are kept.
template <class T>
Result<T> as_run_failure(Result<T> result) {
  if (!result && result.error().code != ErrorCode::kUsage && result.error().code != ErrorCode::kCancelled)
    result.error().code = ErrorCode::kInternal;
  return result;
}

}  // namespace hm
