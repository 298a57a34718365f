#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace hm {

/// Why a request, a connection or a message of a client was refused.
enum class Refused : std::uint8_t {
  kHost,        ///< a name that is not this machine's
  kOrigin,      ///< a page of elsewhere
  kToken,       ///< missing or wrong
  kFull,        ///< as many viewers, pilots or files as there may be
  kRequest,     ///< no HTTP request that is served: malformed, too long, another method, with a body
  kConnection,  ///< too many: closed without an answer
  kMessage,     ///< against the rules of its WebSocket, or for what is not there
  kTooBig,      ///< a message beyond the limit
  kTooMany,     ///< messages or requests in a second
  kSilent,      ///< no request, handshake, hello or answer to a ping in time, or messages unread
  kCommand,     ///< of a pilot, answered with the reason
  kEnd
};

/// How often clients were refused, by reason. Not thread safe: it belongs to the server's thread.
class RefusalCounts {
 public:
  /// Names in `/api/status`.
  static constexpr std::array<std::string_view, static_cast<std::size_t>(Refused::kEnd)> kNames{
      "host",    "origin",  "token",    "full",   "request", "connection",
      "message", "too_big", "too_many", "silent", "command"};

  void add(Refused why, std::uint64_t times = 1) { counts_[static_cast<std::size_t>(why)] += times; }
  [[nodiscard]] std::uint64_t of(Refused why) const { return counts_[static_cast<std::size_t>(why)]; }

 private:
  std::array<std::uint64_t, kNames.size()> counts_{};
};

}  // namespace hm
