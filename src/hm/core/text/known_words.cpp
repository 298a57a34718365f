#include "hm/core/text/known_words.hpp"

#include <algorithm>
#include <utility>

namespace hm {

KnownWords known_words(std::string_view text, std::span<const std::string_view> known) {
  KnownWords found;
  std::string word;
  for (const char c : std::string(text) + ",") {
    if (c != ',' && c != ' ') {
      word += c;
    } else if (!word.empty()) {
      if (std::ranges::find(known, word) == known.end()) {
        found.unknown = std::move(word);
        return found;
      }
      found.words.push_back(std::move(word));
      word.clear();
    }
  }
  return found;
}

}  // namespace hm
