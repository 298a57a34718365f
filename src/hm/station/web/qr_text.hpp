#pragma once
#include <optional>
#include <string>

namespace hm {

/// QR code of a text for a terminal: two modules a character in height (half blocks), with the quiet zone of
/// four modules, for light letters on a dark ground. Nothing if the text is too long for a code (about 2,900
/// bytes).
std::optional<std::string> qr_text(const std::string& text);

}  // namespace hm
