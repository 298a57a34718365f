#pragma once
#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include "hm/core/json_value.hpp"
#include "hm/core/result.hpp"

namespace hm {

enum class JsonStyle {
  kCompact,  ///< one line
  kPretty,   ///< indented by two spaces
};

/// Writes a JSON document as text (RFC 8259, UTF-8, no newline at the end). Keys keep their order; NaN and
/// infinities become null, invalid UTF-8 becomes U+FFFD, floating-point numbers round-trip exactly.
std::string to_json_text(const JsonValue& value, JsonStyle style = JsonStyle::kPretty);

/// Parses a JSON document; errors name `where` (a path), line and column. Of repeated keys the last one
/// counts. Integers beyond 64 bits become doubles; nesting deeper than 200 levels is an error.
Result<JsonValue> parse_json(std::string_view text, const std::string& where);

/// Reads a file and parses it; also an error: it is larger than `max_bytes`, or cannot be read.
Result<JsonValue> read_json_file(const std::filesystem::path& path,
                                 std::size_t max_bytes = std::size_t{1} << 30);

}  // namespace hm
