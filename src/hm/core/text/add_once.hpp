#pragma once
#include <algorithm>
#include <string>
#include <utility>
#include <vector>

namespace hm {

/// Appends a sentence unless it is there.
inline void add_once(std::vector<std::string>& sentences, std::string sentence) {
  if (std::ranges::find(sentences, sentence) == sentences.end()) sentences.push_back(std::move(sentence));
}

}  // namespace hm
