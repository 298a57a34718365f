#pragma once
#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/io/bytes/output_file.hpp"

namespace hm {

/// Reads a whole file. Errors: not found, a folder, unreadable, or larger than `max_bytes`.
Result<std::vector<std::uint8_t>> read_file_bytes(const std::filesystem::path& path,
                                                  std::size_t max_bytes = std::size_t{1} << 30);
/// Writes (replaces) a file atomically: completely or not at all. Errors of the file system are returned.
Result<void> write_file_bytes(const std::filesystem::path& path, std::span<const std::uint8_t> bytes,
                              Durability durability = Durability::kBeforeRename);
Result<void> write_file_text(const std::filesystem::path& path, std::string_view text);

}  // namespace hm
