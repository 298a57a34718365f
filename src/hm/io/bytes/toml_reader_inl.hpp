#pragma once
// Shared by the readers of the project's own TOML files. Include only in .cpp files of this room: needs
// toml++.
#include <fmt/format.h>
#include <algorithm>
#include <filesystem>
#include <initializer_list>
#include <optional>
#include <string_view>
#include <utility>

#include <toml++/toml.h>

#include "hm/core/params.hpp"
#include "hm/core/result.hpp"
#include "hm/io/bytes/file_bytes.hpp"

namespace hm {

/// Base class of a reader of one TOML file; keeps the first mistake with its line and ignores later ones.
class TomlReader {
 protected:
  explicit TomlReader(std::filesystem::path path) : path_(std::move(path)) {}

  /// Table of this name, with its keys checked; nullptr if missing.
  const toml::table* table(const toml::table& parent, std::string_view key,
                           std::initializer_list<std::string_view> known) {
    const toml::node* node = parent.get(key);
    if (node == nullptr) return nullptr;
    const toml::table* found = node->as_table();
    if (found == nullptr)
      mistake(node->source(), "`{}` is a table: write [{}]", key, key);
    else
      check_keys(*found, fmt::format(" in [{}]", key), known);
    return found;
  }

  void check_keys(const toml::table& table, std::string_view what,
                  std::initializer_list<std::string_view> known) {
    for (const auto& [key, value] : table)
      if (std::ranges::find(known, key.str()) == known.end())
        mistake(value.source(), "unknown key `{}`{}; known are {}", key.str(), what, fmt::join(known, ", "));
  }

  template <class... Args>
  void mistake(const toml::source_region& place, fmt::format_string<Args...> format, Args&&... args) {
    if (error_) return;
    error_ = Error{ErrorCode::kInvalidValue, fmt::format(format, std::forward<Args>(args)...),
                   fmt::format("{}:{}", path_.string(), place.begin.line)};
  }

  std::filesystem::path path_;
  std::optional<Error> error_;
};

/// Parses a small TOML file (see check_toml_text()). Errors name file and line.
inline Result<toml::table> parse_toml_file(const std::filesystem::path& path) {
  const auto bytes = read_file_bytes(path, kMaxTomlBytes);
  if (!bytes) return forward_error(bytes);
  const std::string_view text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
  if (const auto checked = check_toml_text(text, path.string()); !checked) return forward_error(checked);
  try {
    return toml::parse(text);
  } catch (const toml::parse_error& error) {
    return fail(ErrorCode::kCorrupted, fmt::format("{}:{}", path.string(), error.source().begin.line), "{}",
                error.description());
  }
}

}  // namespace hm
