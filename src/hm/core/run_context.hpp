#pragma once
#include <stop_token>
#include <string>

#include "hm/core/log.hpp"
#include "hm/core/progress.hpp"
#include "hm/core/result.hpp"

namespace hm {

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
