#pragma once
#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>

#include "hm/core/check.hpp"
#include "hm/core/result.hpp"

namespace hm::fuzz {

/// A reader of files, run over bytes that may be anything.
struct Reader {
  std::string_view name;  ///< as in `./hm fuzz NAME`
  /// True when the bytes were read, false when they were refused with an error. Aborts when the error lacks
  /// its text or place, or when what was read breaks a promise of the reader.
  bool (*run)(std::span<const std::uint8_t> bytes);
};

/// Every reader of the product, by name.
std::span<const Reader> readers();
/// The one of this name, or nullptr.
const Reader* find_reader(std::string_view name);

/// Writes bytes as a file into a temporary folder of this process; `name` may begin with a folder.
std::filesystem::path as_file(const std::filesystem::path& name, std::span<const std::uint8_t> bytes);

/// Whether it was read; a refusal must say what is wrong and where.
template <class T>
bool accepted(const Result<T>& result) {
  if (result) return true;
  HM_CHECK(!result.error().message.empty() && !result.error().where.empty(),
           "an error without text or place: {}", to_string(result.error()));
  return false;
}

}  // namespace hm::fuzz
