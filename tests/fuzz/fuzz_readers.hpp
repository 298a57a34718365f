#pragma once
#include <cstdint>
#include <span>
#include <string_view>

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

}  // namespace hm::fuzz
