#pragma once
#include <concepts>
#include <cstdint>
#include <string>
#include <string_view>

namespace hm {

/// Formats an integer with thousands separators: 1234567 -> "1,234,567"; -1234 -> "-1,234".
std::string group_digits(std::int64_t number);
std::string with_thousands(std::integral auto number) {
  return group_digits(static_cast<std::int64_t>(number));
}

/// Noun for a count: "keyframe" for 1, else its plural, formed with an s unless given.
std::string noun_for(std::int64_t count, std::string_view noun, std::string_view plural = {});

/// Formats a count with its noun: "0 frames", "1 frame", "1,234 frames"; counted(n, "vertex", "vertices").
std::string counted(std::integral auto count, std::string_view noun, std::string_view plural = {}) {
  return with_thousands(count) + " " + noun_for(static_cast<std::int64_t>(count), noun, plural);
}

}  // namespace hm
