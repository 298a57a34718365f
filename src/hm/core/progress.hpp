#pragma once
#include <cstddef>
#include <functional>
#include <string>

namespace hm {

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

}  // namespace hm
