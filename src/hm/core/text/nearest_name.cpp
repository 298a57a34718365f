#include "hm/core/text/nearest_name.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <limits>
#include <numeric>
#include <string>
#include <vector>

namespace hm {
namespace {

std::string lower(std::string_view text) {
  std::string result(text);
  for (char& c : result) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return result;
}

/// Edit distance with transpositions of neighbouring letters (optimal string alignment).
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
  std::iota(last.begin(), last.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t changed = last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      row[j] = std::min({changed, last[j] + 1, row[j - 1] + 1});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        row[j] = std::min(row[j], before[j - 2] + 1);
    }
    std::swap(before, last);
    std::swap(last, row);
  }
  return last[b.size()];
}

/// Cost of a name that contains the word, smaller is better; nothing when it does not contain it.
std::optional<std::size_t> rank_of_containing(std::string_view name, std::string_view word) {
  constexpr std::size_t kMinLetters = 3;
  const std::size_t at = name.find(word);
  if (word.size() < kMinLetters || at == std::string_view::npos) return std::nullopt;
  const bool begins_part = at == 0 || name[at - 1] == '.' || name[at - 1] == '_' || name[at - 1] == '-';
  constexpr std::size_t kInside = 1000;
  return (begins_part ? 0 : kInside) + name.size();
}

}  // namespace

std::optional<std::string_view> nearest_name(std::string_view word, std::span<const std::string_view> names) {
  const std::string wanted = lower(word);
  std::optional<std::string_view> nearest;
  std::size_t best = std::numeric_limits<std::size_t>::max();
  const auto consider = [&](std::string_view name, std::size_t rank) {
    if (rank < best) best = rank, nearest = name;
  };
  for (const std::string_view name : names)
    if (const auto rank = rank_of_containing(lower(name), wanted)) consider(name, *rank);
  if (nearest) return nearest;
  for (const std::string_view name : names) {
    const std::size_t distance = edit_distance(lower(name), wanted);
    if (3 * distance <= std::max(name.size(), wanted.size())) consider(name, distance);
  }
  return nearest;
}

std::string unknown_name(std::string_view kind, std::string_view word,
                         std::span<const std::string_view> names) {
  if (const auto nearest = nearest_name(word, names))
    return fmt::format("unknown {} '{}'; did you mean '{}'?", kind, word, *nearest);
  std::string text = fmt::format("unknown {} '{}'; valid ones are", kind, word);
  for (const std::string_view name : names) text.append(1, ' ').append(name);
  return text;
}

}  // namespace hm
