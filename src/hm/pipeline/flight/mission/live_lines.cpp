#include "hm/pipeline/flight/mission/live_lines.hpp"

#include <poll.h>
#include <unistd.h>

#include <array>
#include <cerrno>

namespace hm {
namespace {

constexpr std::size_t kMostLine = 4096;

}  // namespace

/// Appends what can be read at once; false when there is nothing (any more).
bool LiveLines::read_some() {
  pollfd request{descriptor_, POLLIN, 0};
  if (::poll(&request, 1, 0) <= 0) return false;
  std::array<char, 1024> bytes;
  const ssize_t count = ::read(descriptor_, bytes.data(), bytes.size());
  if (count < 0 && (errno == EINTR || errno == EAGAIN)) return false;
  if (count <= 0) {
    ended_ = true;
    return false;
  }
  rest_.append(bytes.data(), static_cast<std::size_t>(count));
  return rest_.size() <= kMostLine;
}

std::vector<std::string> LiveLines::take() {
  while (!ended_ && read_some()) {
  }
  std::vector<std::string> lines;
  for (std::size_t end = rest_.find('\n'); end != std::string::npos; end = rest_.find('\n')) {
    lines.push_back(rest_.substr(0, end));
    rest_.erase(0, end + 1);
  }
  if ((ended_ && !rest_.empty()) || rest_.size() > kMostLine) {
    lines.push_back(rest_.substr(0, kMostLine));
    rest_.clear();
  }
  return lines;
}

}  // namespace hm
