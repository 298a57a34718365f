#pragma once
#include <functional>
#include <string>

namespace hm {

enum class LogLevel { kInfo, kWarning };

/// Where a pipeline sends its messages. The library itself never prints: a front end passes a sink, and
/// an empty sink discards.
using LogSink = std::function<void(LogLevel, const std::string& message)>;

}  // namespace hm
