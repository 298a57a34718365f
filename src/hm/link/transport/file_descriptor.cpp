#include "hm/link/transport/file_descriptor.hpp"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>

namespace hm {

void FileDescriptor::reset(int number) {
  if (number_ >= 0) ::close(number_);
  number_ = number;
}

bool FileDescriptor::wait_readable(Duration limit) const {
  constexpr std::int64_t kNsPerMs = 1'000'000, kMaxMs = 60'000;
  pollfd entry{number_, POLLIN, 0};
  const auto limit_ms = std::clamp<std::int64_t>((limit.ns + kNsPerMs - 1) / kNsPerMs, 0, kMaxMs);
  return number_ >= 0 && ::poll(&entry, 1, static_cast<int>(limit_ms)) > 0;
}

bool FileDescriptor::has_hung_up() const {
  pollfd entry{number_, POLLIN, 0};
  return number_ >= 0 && ::poll(&entry, 1, 0) > 0 && (entry.revents & (POLLHUP | POLLERR | POLLNVAL)) != 0;
}

}  // namespace hm
