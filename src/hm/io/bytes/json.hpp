#pragma once
#include <string>
#include <string_view>

#include "hm/core/json_value.hpp"
#include "hm/core/result.hpp"

namespace hm {

enum class JsonStyle {
  kCompact,  ///< one line
  kPretty,   ///< two spaces a level
};

/// A JSON document as text (RFC 8259, UTF-8, no newline at the end). Keys keep their order; NaN and
/// infinities become null, bytes that are not UTF-8 become U+FFFD, real numbers are written so that they read
/// back exactly.
std::string to_json_text(const JsonValue& value, JsonStyle style = JsonStyle::kPretty);

/// Reads a JSON document; `where` (a path) names it in errors, with line and column. Of repeated keys the
/// last counts. Integers beyond 64 bits become real numbers; more than 200 levels are an error.
Result<JsonValue> parse_json(std::string_view text, const std::string& where);

}  // namespace hm
