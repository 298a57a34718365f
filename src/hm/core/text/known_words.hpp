#pragma once
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace hm {

/// Words of a list, in their order.
struct KnownWords {
  std::vector<std::string> words;  ///< up to the first unknown one
  std::string unknown;             ///< the first unknown one; empty: none
};
/// Splits a list of words that are separated by commas or blanks.
KnownWords known_words(std::string_view text, std::span<const std::string_view> known);

}  // namespace hm
