#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "hm/link/codec/mavlink_frame.hpp"
#include "hm/link/codec/mavlink_telemetry.hpp"

namespace hm {

/// Text of a STATUSTEXT message; printable ASCII only, other letters are '?'.
struct LinkText {
  std::uint8_t severity = 0;  ///< MavSeverity
  std::string text;
};

/// Puts the parts of long texts together. A text whose parts do not all come is given as far as it did, with
/// "..." for what is missing, when another one begins.
class StatusTextReader {
 public:
  /// The texts that end with this message, in order.
  std::vector<LinkText> add(const MavStatusText& message, MavlinkAddress from);

 private:
  void finish(std::vector<LinkText>& texts, bool is_whole);

  struct Begun {
    MavlinkAddress from;
    std::uint16_t id = 0;
    unsigned parts = 0;
    LinkText text;
  };
  std::optional<Begun> begun_;
};

}  // namespace hm
